# Print an optspec for argparse to handle cmd's options that are independent of any subcommand.
function __fish_gip_global_optspecs
    string join \n h/help V/version
end

function __fish_gip_needs_command
    # Figure out if the current invocation already has a command.
    set -l cmd (commandline -opc)
    set -e cmd[1]
    argparse -s (__fish_gip_global_optspecs) -- $cmd 2>/dev/null
    or return
    if set -q argv[1]
        # Also print the command, so this can be used to figure out what it is.
        echo $argv[1]
        return 1
    end
    return 0
end

function __fish_gip_using_subcommand
    set -l cmd (__fish_gip_needs_command)
    test -z "$cmd"
    and return 1
    contains -- $cmd[1] $argv
end

complete -c gip -n "__fish_gip_needs_command" -s h -l help -d 'Print help'
complete -c gip -n "__fish_gip_needs_command" -s V -l version -d 'Print version'
complete -c gip -n "__fish_gip_needs_command" -f -a "encode" -d 'Encodes a picture as a .gip file'
complete -c gip -n "__fish_gip_needs_command" -f -a "decode" -d 'Decodes a .gip file to a picture'
complete -c gip -n "__fish_gip_needs_command" -f -a "batch" -d 'Encodes or decodes many files and whole folders, one picture per core'
complete -c gip -n "__fish_gip_needs_command" -f -a "info" -d 'Shows what .gip files contain'
complete -c gip -n "__fish_gip_needs_command" -f -a "compare" -d 'Measures how much two pictures differ'
complete -c gip -n "__fish_gip_needs_command" -f -a "prefix" -d 'Cuts a small .gip file from the beginning of a large one'
complete -c gip -n "__fish_gip_needs_command" -f -a "transform" -d 'Turns, mirrors or crops a .gip file without encoding it again'
complete -c gip -n "__fish_gip_needs_command" -f -a "export" -d 'Writes the Gaussians of a .gip file for other programs'
complete -c gip -n "__fish_gip_needs_command" -f -a "import" -d 'Makes a .gip file of Gaussians of other programs, or of what `gip export` writes'
complete -c gip -n "__fish_gip_needs_command" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c gip -n "__fish_gip_using_subcommand encode" -l gaussians -d 'At most N Gaussians, from 1 to 4194304' -r
complete -c gip -n "__fish_gip_using_subcommand encode" -l bpp -d 'A file of at most B bits per pixel, from 0.000001 to 1000000' -r
complete -c gip -n "__fish_gip_using_subcommand encode" -l bytes -d 'A file of at most N bytes, from 1 to 1073741824' -r
complete -c gip -n "__fish_gip_using_subcommand encode" -l psnr -d 'A PSNR of the decoded file without its texture of DB decibels, from 1 to 120' -r
complete -c gip -n "__fish_gip_using_subcommand encode" -l quality -d 'A visual quality from 0 (smallest) to 100 (best), on the scale of SSIMULACRA2, of the picture without its texture; no more than 97 is aimed at [default: 75]' -r
complete -c gip -n "__fish_gip_using_subcommand encode" -l lambda -d 'A Lagrange multiplier from 0.01 to 1000000: the squared error that a bit must save, where samples are 0 to 255. For comparisons over many pictures' -r
complete -c gip -n "__fish_gip_using_subcommand encode" -l tune -d 'What to minimize for the size of the file' -r -f -a "visual\t'The error that a person sees'
psnr\t'The squared error, for the highest PSNR'"
complete -c gip -n "__fish_gip_using_subcommand encode" -l effort -d 'Time to spend, from 1 (least) to 7 (most)' -r
complete -c gip -n "__fish_gip_using_subcommand encode" -l texture -d 'Strength of the texture, from 0 (none) to 100: with 50, about as strong as in the picture. It takes the place of fine irregular detail that the file has no bits for, such as sand, water and leaves. Files of --tune psnr and of the packed coding have none' -r
complete -c gip -n "__fish_gip_using_subcommand encode" -l first-layer -d 'Let the first layer make a file of at most N bytes, from 80 to 65536, as a placeholder: `gip prefix` cuts it off. Colour space, ICC profile and orientation are in it; all other metadata are stored after it. Not with --precision packed or f32, whose layers have the usual size' -r
complete -c gip -n "__fish_gip_using_subcommand encode" -l precision -d 'How the Gaussians are stored' -r -f -a "f32\t'Packed coding with 32-bit floats: the fitted values themselves; files several times as large'
packed\t'Packed coding: codes of fixed bit depths, after quantization-aware training'
entropy\t'Entropy coding: codes chosen by rate-distortion optimization; the smallest files'"
complete -c gip -n "__fish_gip_using_subcommand encode" -l seed -d 'Seed of the random numbers; the same picture, options and seed give the same file' -r
complete -c gip -n "__fish_gip_using_subcommand encode" -l limit -d 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits' -r
complete -c gip -n "__fish_gip_using_subcommand encode" -l metadata -d 'Which metadata is kept [default: all, but safe for the thumbnails of gip batch]' -r -f -a "all\t'All of it, as it is'
safe\t'Colours, orientation, title, description, artist, copyright and dates; no position, maker notes, embedded thumbnails, cameras, serial numbers, owners, comments or anything unknown'
none\t'Only the colour space in codes (cICP), not even a colour profile'"
complete -c gip -n "__fish_gip_using_subcommand encode" -l threads -d 'Number of threads, from 1 to 1024; the result does not depend on it [default: one per core]' -r
complete -c gip -n "__fish_gip_using_subcommand encode" -l keep-invisible -d 'Keep colours where alpha is 0. By default what does not show takes the colours around it: the file is smaller, and scaled pictures have no fringes'
complete -c gip -n "__fish_gip_using_subcommand encode" -l force -d 'Write OUTPUT even if its name does not end in .gip'
complete -c gip -n "__fish_gip_using_subcommand encode" -l allow-partial -d 'If INPUT is truncated or damaged, encode what can be read of it, and print a warning, instead of failing'
complete -c gip -n "__fish_gip_using_subcommand encode" -l preserve-times -d 'Give the result the times of its source: of the last change and the last access, as cp does with --preserve=timestamps'
complete -c gip -n "__fish_gip_using_subcommand encode" -l json -d 'Print the report as one JSON object. It goes to standard error if OUTPUT is `-`'
complete -c gip -n "__fish_gip_using_subcommand encode" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c gip -n "__fish_gip_using_subcommand decode" -l scale -d 'Render F times as wide and high, from 0.001 to 1000. The Gaussians themselves are scaled; no pixels are resampled' -r
complete -c gip -n "__fish_gip_using_subcommand decode" -l size -d 'Render the whole picture at W by H pixels, which it has when it is upright' -r
complete -c gip -n "__fish_gip_using_subcommand decode" -l fit -d 'Render the whole picture as large as fits into SIZE: one number for both sides, or WxH' -r
complete -c gip -n "__fish_gip_using_subcommand decode" -l region -d 'Render only a region: the W by H pixels whose first one is (X, Y). Coordinates are pixels of the upright output, after --scale, --size or --fit' -r
complete -c gip -n "__fish_gip_using_subcommand decode" -l format -d 'The format of OUTPUT, as an extension, whatever the name of OUTPUT is' -r
complete -c gip -n "__fish_gip_using_subcommand decode" -l metadata -d 'Which metadata is kept [default: all, but safe for the thumbnails of gip batch]' -r -f -a "all\t'All of it, as it is'
safe\t'Colours, orientation, title, description, artist, copyright and dates; no position, maker notes, embedded thumbnails, cameras, serial numbers, owners, comments or anything unknown'
none\t'Only the colour space in codes (cICP), not even a colour profile'"
complete -c gip -n "__fish_gip_using_subcommand decode" -l limit -d 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits' -r
complete -c gip -n "__fish_gip_using_subcommand decode" -l threads -d 'Number of threads, from 1 to 1024; the result does not depend on it [default: one per core]' -r
complete -c gip -n "__fish_gip_using_subcommand decode" -l no-texture -d 'Leave out the picture\'s texture: the noise in place of sand, water or leaves. The picture is then smoother, and nearer to the source sample by sample'
complete -c gip -n "__fish_gip_using_subcommand decode" -l allow-partial -d 'If the file is truncated or damaged, write the picture of the Gaussians that can be decoded, and print a warning, instead of failing'
complete -c gip -n "__fish_gip_using_subcommand decode" -l preserve-times -d 'Give the result the times of its source: of the last change and the last access, as cp does with --preserve=timestamps'
complete -c gip -n "__fish_gip_using_subcommand decode" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c gip -n "__fish_gip_using_subcommand batch" -l out -d 'The folder of the results; it is made if there is none' -r -F
complete -c gip -n "__fish_gip_using_subcommand batch" -l include -d 'Take only files that match GLOB, or any of several when given again: a pattern as in .gitignore, of the path below INPUT. Upper and lower case are the same' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l exclude -d 'Leave out files and folders that match GLOB, even if --include takes them; may be given again' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l jobs -d 'Number of pictures that are worked on at the same time, from 1 to 1024; each takes one thread [default: one per core]' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l budget -d 'Most megapixels that are worked on at the same time, from 0.001 to 1000000 [default: 16 for each job]' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l shards -d 'Write tar files of N pictures each, as WebDataset reads them, in place of a file per picture: DIR/000000.tar and so on, from 1 to 1000000' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l manifest -d 'Write a line of JSON for every file to FILE, or to standard output if it is `-`' -r -F
complete -c gip -n "__fish_gip_using_subcommand batch" -l limit -d 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l thumbnail -d 'Decode .gip files to thumbnails that fit into SIZE: one number for both sides, or WxH' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l format -d 'The format of decoded pictures, as an extension: png, tif, webp, jpg, bmp, tga, qoi, gif, ico, ff, pgm, ppm, pnm or pam' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l metadata -d 'Which metadata is kept [default: all, but safe for the thumbnails of gip batch]' -r -f -a "all\t'All of it, as it is'
safe\t'Colours, orientation, title, description, artist, copyright and dates; no position, maker notes, embedded thumbnails, cameras, serial numbers, owners, comments or anything unknown'
none\t'Only the colour space in codes (cICP), not even a colour profile'"
complete -c gip -n "__fish_gip_using_subcommand batch" -l gaussians -d 'At most N Gaussians, from 1 to 4194304' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l bpp -d 'A file of at most B bits per pixel, from 0.000001 to 1000000' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l bytes -d 'A file of at most N bytes, from 1 to 1073741824' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l psnr -d 'A PSNR of the decoded file without its texture of DB decibels, from 1 to 120' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l quality -d 'A visual quality from 0 (smallest) to 100 (best), on the scale of SSIMULACRA2, of the picture without its texture; no more than 97 is aimed at [default: 75]' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l lambda -d 'A Lagrange multiplier from 0.01 to 1000000: the squared error that a bit must save, where samples are 0 to 255. For comparisons over many pictures' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l tune -d 'What to minimize for the size of the file' -r -f -a "visual\t'The error that a person sees'
psnr\t'The squared error, for the highest PSNR'"
complete -c gip -n "__fish_gip_using_subcommand batch" -l effort -d 'Time to spend, from 1 (least) to 7 (most)' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l texture -d 'Strength of the texture, from 0 (none) to 100: with 50, about as strong as in the picture. It takes the place of fine irregular detail that the file has no bits for, such as sand, water and leaves. Files of --tune psnr and of the packed coding have none' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l first-layer -d 'Let the first layer make a file of at most N bytes, from 80 to 65536, as a placeholder: `gip prefix` cuts it off. Colour space, ICC profile and orientation are in it; all other metadata are stored after it. Not with --precision packed or f32, whose layers have the usual size' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l precision -d 'How the Gaussians are stored' -r -f -a "f32\t'Packed coding with 32-bit floats: the fitted values themselves; files several times as large'
packed\t'Packed coding: codes of fixed bit depths, after quantization-aware training'
entropy\t'Entropy coding: codes chosen by rate-distortion optimization; the smallest files'"
complete -c gip -n "__fish_gip_using_subcommand batch" -l seed -d 'Seed of the random numbers; the same picture, options and seed give the same file' -r
complete -c gip -n "__fish_gip_using_subcommand batch" -l resume -d 'Skip files whose result is whole and newer than they are'
complete -c gip -n "__fish_gip_using_subcommand batch" -l allow-partial -d 'Take what can be read of a file that is truncated or damaged, with a warning, instead of failing with it. `gip encode --help` says for which formats damage in the middle goes unnoticed'
complete -c gip -n "__fish_gip_using_subcommand batch" -l decode -d 'Decode .gip files; of a folder, only these are taken'
complete -c gip -n "__fish_gip_using_subcommand batch" -l no-texture -d 'Leave out the texture of decoded pictures: the noise in place of sand, water or leaves'
complete -c gip -n "__fish_gip_using_subcommand batch" -l preserve-times -d 'Give the result the times of its source: of the last change and the last access, as cp does with --preserve=timestamps'
complete -c gip -n "__fish_gip_using_subcommand batch" -l keep-invisible -d 'Keep colours where alpha is 0. By default what does not show takes the colours around it: the file is smaller, and scaled pictures have no fringes'
complete -c gip -n "__fish_gip_using_subcommand batch" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c gip -n "__fish_gip_using_subcommand info" -l limit -d 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits' -r
complete -c gip -n "__fish_gip_using_subcommand info" -l json -d 'Print one JSON object for each file, on a line of its own: the name and the size of the file, all fields of the header, number and bytes of the chunks of each type, bits per Gaussian by attribute, and sizes of the metadata'
complete -c gip -n "__fish_gip_using_subcommand info" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c gip -n "__fish_gip_using_subcommand compare" -l limit -d 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits' -r
complete -c gip -n "__fish_gip_using_subcommand compare" -l keep-invisible -d 'Count colours as they are stored, where alpha is 0, too'
complete -c gip -n "__fish_gip_using_subcommand compare" -l json -d 'Print one JSON object: width, height, channels, depth (bits per sample), psnr (in dB), ms_ssim, max_abs_error (in quantization steps of that depth). The PSNR of identical pictures, which is infinite, is given as 999'
complete -c gip -n "__fish_gip_using_subcommand compare" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c gip -n "__fish_gip_using_subcommand prefix" -l force -d 'Write OUTPUT even if its name does not end in .gip'
complete -c gip -n "__fish_gip_using_subcommand prefix" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c gip -n "__fish_gip_using_subcommand transform" -l crop -d 'Keep only the W by H pixels whose first one is (X, Y), in pixels of the upright picture' -r
complete -c gip -n "__fish_gip_using_subcommand transform" -l rotate -d 'Rotate clockwise by so many degrees' -r -f -a "90\t'A quarter of a turn'
180\t'Half of a turn'
270\t'Three quarters of a turn'"
complete -c gip -n "__fish_gip_using_subcommand transform" -l flip -d 'Mirror the picture' -r -f -a "horizontal\t'Left and right'
vertical\t'Top and bottom'"
complete -c gip -n "__fish_gip_using_subcommand transform" -l metadata -d 'Which metadata is kept [default: all, but safe for the thumbnails of gip batch]' -r -f -a "all\t'All of it, as it is'
safe\t'Colours, orientation, title, description, artist, copyright and dates; no position, maker notes, embedded thumbnails, cameras, serial numbers, owners, comments or anything unknown'
none\t'Only the colour space in codes (cICP), not even a colour profile'"
complete -c gip -n "__fish_gip_using_subcommand transform" -l limit -d 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits' -r
complete -c gip -n "__fish_gip_using_subcommand transform" -l threads -d 'Number of threads, from 1 to 1024; the result does not depend on it [default: one per core]' -r
complete -c gip -n "__fish_gip_using_subcommand transform" -l force -d 'Write OUTPUT even if its name does not end in .gip'
complete -c gip -n "__fish_gip_using_subcommand transform" -l preserve-times -d 'Give the result the times of its source: of the last change and the last access, as cp does with --preserve=timestamps'
complete -c gip -n "__fish_gip_using_subcommand transform" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c gip -n "__fish_gip_using_subcommand export" -l format -d 'The format, in place of the one that the extension of OUTPUT names' -r -f -a "npz\t'Arrays of NumPy, as numpy.load reads them'
json\t'One JSON object'
jsonl\t'A JSON object of the header on the first line, and one of a Gaussian on each further line'
ply\t'The PLY of viewers of 3D Gaussians'
svg\t'Radial gradients; it cannot be imported'"
complete -c gip -n "__fish_gip_using_subcommand export" -l limit -d 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits' -r
complete -c gip -n "__fish_gip_using_subcommand export" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c gip -n "__fish_gip_using_subcommand import" -l format -d 'The format, in place of the one that the extension of INPUT names' -r -f -a "npz\t'Arrays of NumPy, as numpy.load reads them'
json\t'One JSON object'
jsonl\t'A JSON object of the header on the first line, and one of a Gaussian on each further line'
ply\t'The PLY of viewers of 3D Gaussians'
svg\t'Radial gradients; it cannot be imported'"
complete -c gip -n "__fish_gip_using_subcommand import" -l precision -d 'How the Gaussians are stored' -r -f -a "f32\t'Packed coding with 32-bit floats, which lose nothing'
packed\t'Packed coding with codes of fixed bit depths, whose ranges are those of the values'
entropy\t'Entropy coding, rounded to its grid, for the smallest files; with the quartic kernel only'"
complete -c gip -n "__fish_gip_using_subcommand import" -l bits -d 'Bit depths of position, shape and colour with --precision packed, each from 1 to 16 [default: 12,10,6]' -r
complete -c gip -n "__fish_gip_using_subcommand import" -l color-step -d 'Step of colour with --precision entropy, from 0.000001 to 1000: the difference of the amplitudes of neighbouring codes, where 1 is a full sample, times the Gaussian\'s size in pixels. Stronger ones are finer in position and shape as well [default: 0.02]' -r
complete -c gip -n "__fish_gip_using_subcommand import" -l parameterization -d 'What is stored of a shape, unless with --precision entropy' -r -f -a "cholesky\t'The Cholesky factor of the covariance, in pixels'
covariance\t'The covariance, in square pixels'
rotation-scale\t'Two standard deviations in pixels and an angle'"
complete -c gip -n "__fish_gip_using_subcommand import" -l size -d 'Size of the picture in pixels, in which centres and covariances are' -r
complete -c gip -n "__fish_gip_using_subcommand import" -l depth -d 'Bits per sample, 8 or 16' -r
complete -c gip -n "__fish_gip_using_subcommand import" -l kernel -d 'The weight of a Gaussian around its centre' -r -f -a "quartic\t'(1 - q / 4)^2 for q below 4'
exponential\t'exp(-q / 2) up to the cut-off'"
complete -c gip -n "__fish_gip_using_subcommand import" -l cutoff -d 'The largest squared Mahalanobis distance with a weight over 0, of the exponential kernel: over 0, at most 64 [default: 11.082527, where the weight is 1/255]' -r
complete -c gip -n "__fish_gip_using_subcommand import" -l base-color -d 'The colour that the Gaussians are added to: a sample for all channels, or one for each, from 0 to 255, or to 65535 with 16 bits' -r
complete -c gip -n "__fish_gip_using_subcommand import" -l limit -d 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits' -r
complete -c gip -n "__fish_gip_using_subcommand import" -l threads -d 'Number of threads, from 1 to 1024; the result does not depend on it [default: one per core]' -r
complete -c gip -n "__fish_gip_using_subcommand import" -l force -d 'Write OUTPUT even if its name does not end in .gip'
complete -c gip -n "__fish_gip_using_subcommand import" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c gip -n "__fish_gip_using_subcommand help; and not __fish_seen_subcommand_from encode decode batch info compare prefix transform export import help" -f -a "encode" -d 'Encodes a picture as a .gip file'
complete -c gip -n "__fish_gip_using_subcommand help; and not __fish_seen_subcommand_from encode decode batch info compare prefix transform export import help" -f -a "decode" -d 'Decodes a .gip file to a picture'
complete -c gip -n "__fish_gip_using_subcommand help; and not __fish_seen_subcommand_from encode decode batch info compare prefix transform export import help" -f -a "batch" -d 'Encodes or decodes many files and whole folders, one picture per core'
complete -c gip -n "__fish_gip_using_subcommand help; and not __fish_seen_subcommand_from encode decode batch info compare prefix transform export import help" -f -a "info" -d 'Shows what .gip files contain'
complete -c gip -n "__fish_gip_using_subcommand help; and not __fish_seen_subcommand_from encode decode batch info compare prefix transform export import help" -f -a "compare" -d 'Measures how much two pictures differ'
complete -c gip -n "__fish_gip_using_subcommand help; and not __fish_seen_subcommand_from encode decode batch info compare prefix transform export import help" -f -a "prefix" -d 'Cuts a small .gip file from the beginning of a large one'
complete -c gip -n "__fish_gip_using_subcommand help; and not __fish_seen_subcommand_from encode decode batch info compare prefix transform export import help" -f -a "transform" -d 'Turns, mirrors or crops a .gip file without encoding it again'
complete -c gip -n "__fish_gip_using_subcommand help; and not __fish_seen_subcommand_from encode decode batch info compare prefix transform export import help" -f -a "export" -d 'Writes the Gaussians of a .gip file for other programs'
complete -c gip -n "__fish_gip_using_subcommand help; and not __fish_seen_subcommand_from encode decode batch info compare prefix transform export import help" -f -a "import" -d 'Makes a .gip file of Gaussians of other programs, or of what `gip export` writes'
complete -c gip -n "__fish_gip_using_subcommand help; and not __fish_seen_subcommand_from encode decode batch info compare prefix transform export import help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
