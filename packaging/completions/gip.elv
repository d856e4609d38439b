
use builtin;
use str;

set edit:completion:arg-completer[gip] = {|@words|
    fn spaces {|n|
        builtin:repeat $n ' ' | str:join ''
    }
    fn cand {|text desc|
        edit:complex-candidate $text &display=$text' '(spaces (- 14 (wcswidth $text)))$desc
    }
    var command = 'gip'
    for word $words[1..-1] {
        if (str:has-prefix $word '-') {
            break
        }
        set command = $command';'$word
    }
    var completions = [
        &'gip'= {
            cand -h 'Print help'
            cand --help 'Print help'
            cand -V 'Print version'
            cand --version 'Print version'
            cand encode 'Encodes a picture as a .gip file'
            cand decode 'Decodes a .gip file to a picture'
            cand batch 'Encodes or decodes many files and whole folders, one picture per core'
            cand info 'Shows what .gip files contain'
            cand compare 'Measures how much two pictures differ'
            cand prefix 'Cuts a small .gip file from the beginning of a large one'
            cand transform 'Turns, mirrors or crops a .gip file without encoding it again'
            cand export 'Writes the Gaussians of a .gip file for other programs'
            cand import 'Makes a .gip file of Gaussians of other programs, or of what `gip export` writes'
            cand help 'Print this message or the help of the given subcommand(s)'
        }
        &'gip;encode'= {
            cand --gaussians 'At most N Gaussians, from 1 to 4194304'
            cand --bpp 'A file of at most B bits per pixel, from 0.000001 to 1000000'
            cand --bytes 'A file of at most N bytes, from 1 to 1073741824'
            cand --psnr 'A PSNR of the decoded file without its texture of DB decibels, from 1 to 120'
            cand --quality 'A visual quality from 0 (smallest) to 100 (best), on the scale of SSIMULACRA2, of the picture without its texture; no more than 97 is aimed at [default: 75]'
            cand --lambda 'A Lagrange multiplier from 0.01 to 1000000: the squared error that a bit must save, where samples are 0 to 255. For comparisons over many pictures'
            cand --tune 'What to minimize for the size of the file'
            cand --effort 'Time to spend, from 1 (least) to 7 (most)'
            cand --texture 'Strength of the texture, from 0 (none) to 100: with 50, about as strong as in the picture. It takes the place of fine irregular detail that the file has no bits for, such as sand, water and leaves. Files of --tune psnr and of the packed coding have none'
            cand --first-layer 'Let the first layer make a file of at most N bytes, from 80 to 65536, as a placeholder: `gip prefix` cuts it off. Colour space, ICC profile and orientation are in it; all other metadata are stored after it. Not with --precision packed or f32, whose layers have the usual size'
            cand --precision 'How the Gaussians are stored'
            cand --seed 'Seed of the random numbers; the same picture, options and seed give the same file'
            cand --limit 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits'
            cand --metadata 'Which metadata is kept [default: all, but safe for the thumbnails of gip batch]'
            cand --threads 'Number of threads, from 1 to 1024; the result does not depend on it [default: one per core]'
            cand --keep-invisible 'Keep colours where alpha is 0. By default what does not show takes the colours around it: the file is smaller, and scaled pictures have no fringes'
            cand --force 'Write OUTPUT even if its name does not end in .gip'
            cand --allow-partial 'If INPUT is truncated or damaged, encode what can be read of it, and print a warning, instead of failing'
            cand --preserve-times 'Give the result the times of its source: of the last change and the last access, as cp does with --preserve=timestamps'
            cand --json 'Print the report as one JSON object. It goes to standard error if OUTPUT is `-`'
            cand -h 'Print help (see more with ''--help'')'
            cand --help 'Print help (see more with ''--help'')'
        }
        &'gip;decode'= {
            cand --scale 'Render F times as wide and high, from 0.001 to 1000. The Gaussians themselves are scaled; no pixels are resampled'
            cand --size 'Render the whole picture at W by H pixels, which it has when it is upright'
            cand --fit 'Render the whole picture as large as fits into SIZE: one number for both sides, or WxH'
            cand --region 'Render only a region: the W by H pixels whose first one is (X, Y). Coordinates are pixels of the upright output, after --scale, --size or --fit'
            cand --format 'The format of OUTPUT, as an extension, whatever the name of OUTPUT is'
            cand --metadata 'Which metadata is kept [default: all, but safe for the thumbnails of gip batch]'
            cand --limit 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits'
            cand --threads 'Number of threads, from 1 to 1024; the result does not depend on it [default: one per core]'
            cand --no-texture 'Leave out the picture''s texture: the noise in place of sand, water or leaves. The picture is then smoother, and nearer to the source sample by sample'
            cand --allow-partial 'If the file is truncated or damaged, write the picture of the Gaussians that can be decoded, and print a warning, instead of failing'
            cand --preserve-times 'Give the result the times of its source: of the last change and the last access, as cp does with --preserve=timestamps'
            cand -h 'Print help (see more with ''--help'')'
            cand --help 'Print help (see more with ''--help'')'
        }
        &'gip;batch'= {
            cand --out 'The folder of the results; it is made if there is none'
            cand --include 'Take only files that match GLOB, or any of several when given again: a pattern as in .gitignore, of the path below INPUT. Upper and lower case are the same'
            cand --exclude 'Leave out files and folders that match GLOB, even if --include takes them; may be given again'
            cand --jobs 'Number of pictures that are worked on at the same time, from 1 to 1024; each takes one thread [default: one per core]'
            cand --budget 'Most megapixels that are worked on at the same time, from 0.001 to 1000000 [default: 16 for each job]'
            cand --shards 'Write tar files of N pictures each, as WebDataset reads them, in place of a file per picture: DIR/000000.tar and so on, from 1 to 1000000'
            cand --manifest 'Write a line of JSON for every file to FILE, or to standard output if it is `-`'
            cand --limit 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits'
            cand --thumbnail 'Decode .gip files to thumbnails that fit into SIZE: one number for both sides, or WxH'
            cand --format 'The format of decoded pictures, as an extension: png, tif, webp, jpg, bmp, tga, qoi, gif, ico, ff, pgm, ppm, pnm or pam'
            cand --metadata 'Which metadata is kept [default: all, but safe for the thumbnails of gip batch]'
            cand --gaussians 'At most N Gaussians, from 1 to 4194304'
            cand --bpp 'A file of at most B bits per pixel, from 0.000001 to 1000000'
            cand --bytes 'A file of at most N bytes, from 1 to 1073741824'
            cand --psnr 'A PSNR of the decoded file without its texture of DB decibels, from 1 to 120'
            cand --quality 'A visual quality from 0 (smallest) to 100 (best), on the scale of SSIMULACRA2, of the picture without its texture; no more than 97 is aimed at [default: 75]'
            cand --lambda 'A Lagrange multiplier from 0.01 to 1000000: the squared error that a bit must save, where samples are 0 to 255. For comparisons over many pictures'
            cand --tune 'What to minimize for the size of the file'
            cand --effort 'Time to spend, from 1 (least) to 7 (most)'
            cand --texture 'Strength of the texture, from 0 (none) to 100: with 50, about as strong as in the picture. It takes the place of fine irregular detail that the file has no bits for, such as sand, water and leaves. Files of --tune psnr and of the packed coding have none'
            cand --first-layer 'Let the first layer make a file of at most N bytes, from 80 to 65536, as a placeholder: `gip prefix` cuts it off. Colour space, ICC profile and orientation are in it; all other metadata are stored after it. Not with --precision packed or f32, whose layers have the usual size'
            cand --precision 'How the Gaussians are stored'
            cand --seed 'Seed of the random numbers; the same picture, options and seed give the same file'
            cand --resume 'Skip files whose result is whole and newer than they are'
            cand --allow-partial 'Take what can be read of a file that is truncated or damaged, with a warning, instead of failing with it. `gip encode --help` says for which formats damage in the middle goes unnoticed'
            cand --decode 'Decode .gip files; of a folder, only these are taken'
            cand --no-texture 'Leave out the texture of decoded pictures: the noise in place of sand, water or leaves'
            cand --preserve-times 'Give the result the times of its source: of the last change and the last access, as cp does with --preserve=timestamps'
            cand --keep-invisible 'Keep colours where alpha is 0. By default what does not show takes the colours around it: the file is smaller, and scaled pictures have no fringes'
            cand -h 'Print help (see more with ''--help'')'
            cand --help 'Print help (see more with ''--help'')'
        }
        &'gip;info'= {
            cand --limit 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits'
            cand --json 'Print one JSON object for each file, on a line of its own: the name and the size of the file, all fields of the header, number and bytes of the chunks of each type, bits per Gaussian by attribute, and sizes of the metadata'
            cand -h 'Print help (see more with ''--help'')'
            cand --help 'Print help (see more with ''--help'')'
        }
        &'gip;compare'= {
            cand --limit 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits'
            cand --keep-invisible 'Count colours as they are stored, where alpha is 0, too'
            cand --json 'Print one JSON object: width, height, channels, depth (bits per sample), psnr (in dB), ms_ssim, max_abs_error (in quantization steps of that depth). The PSNR of identical pictures, which is infinite, is given as 999'
            cand -h 'Print help (see more with ''--help'')'
            cand --help 'Print help (see more with ''--help'')'
        }
        &'gip;prefix'= {
            cand --force 'Write OUTPUT even if its name does not end in .gip'
            cand -h 'Print help (see more with ''--help'')'
            cand --help 'Print help (see more with ''--help'')'
        }
        &'gip;transform'= {
            cand --crop 'Keep only the W by H pixels whose first one is (X, Y), in pixels of the upright picture'
            cand --rotate 'Rotate clockwise by so many degrees'
            cand --flip 'Mirror the picture'
            cand --metadata 'Which metadata is kept [default: all, but safe for the thumbnails of gip batch]'
            cand --limit 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits'
            cand --threads 'Number of threads, from 1 to 1024; the result does not depend on it [default: one per core]'
            cand --force 'Write OUTPUT even if its name does not end in .gip'
            cand --preserve-times 'Give the result the times of its source: of the last change and the last access, as cp does with --preserve=timestamps'
            cand -h 'Print help (see more with ''--help'')'
            cand --help 'Print help (see more with ''--help'')'
        }
        &'gip;export'= {
            cand --format 'The format, in place of the one that the extension of OUTPUT names'
            cand --limit 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits'
            cand -h 'Print help (see more with ''--help'')'
            cand --help 'Print help (see more with ''--help'')'
        }
        &'gip;import'= {
            cand --format 'The format, in place of the one that the extension of INPUT names'
            cand --precision 'How the Gaussians are stored'
            cand --bits 'Bit depths of position, shape and colour with --precision packed, each from 1 to 16 [default: 12,10,6]'
            cand --color-step 'Step of colour with --precision entropy, from 0.000001 to 1000: the difference of the amplitudes of neighbouring codes, where 1 is a full sample, times the Gaussian''s size in pixels. Stronger ones are finer in position and shape as well [default: 0.02]'
            cand --parameterization 'What is stored of a shape, unless with --precision entropy'
            cand --size 'Size of the picture in pixels, in which centres and covariances are'
            cand --depth 'Bits per sample, 8 or 16'
            cand --kernel 'The weight of a Gaussian around its centre'
            cand --cutoff 'The largest squared Mahalanobis distance with a weight over 0, of the exponential kernel: over 0, at most 64 [default: 11.082527, where the weight is 1/255]'
            cand --base-color 'The colour that the Gaussians are added to: a sample for all channels, or one for each, from 0 to 255, or to 65535 with 16 bits'
            cand --limit 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits'
            cand --threads 'Number of threads, from 1 to 1024; the result does not depend on it [default: one per core]'
            cand --force 'Write OUTPUT even if its name does not end in .gip'
            cand -h 'Print help (see more with ''--help'')'
            cand --help 'Print help (see more with ''--help'')'
        }
        &'gip;help'= {
            cand encode 'Encodes a picture as a .gip file'
            cand decode 'Decodes a .gip file to a picture'
            cand batch 'Encodes or decodes many files and whole folders, one picture per core'
            cand info 'Shows what .gip files contain'
            cand compare 'Measures how much two pictures differ'
            cand prefix 'Cuts a small .gip file from the beginning of a large one'
            cand transform 'Turns, mirrors or crops a .gip file without encoding it again'
            cand export 'Writes the Gaussians of a .gip file for other programs'
            cand import 'Makes a .gip file of Gaussians of other programs, or of what `gip export` writes'
            cand help 'Print this message or the help of the given subcommand(s)'
        }
        &'gip;help;encode'= {
        }
        &'gip;help;decode'= {
        }
        &'gip;help;batch'= {
        }
        &'gip;help;info'= {
        }
        &'gip;help;compare'= {
        }
        &'gip;help;prefix'= {
        }
        &'gip;help;transform'= {
        }
        &'gip;help;export'= {
        }
        &'gip;help;import'= {
        }
        &'gip;help;help'= {
        }
    ]
    $completions[$command]
}
