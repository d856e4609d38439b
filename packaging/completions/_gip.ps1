
using namespace System.Management.Automation
using namespace System.Management.Automation.Language

Register-ArgumentCompleter -Native -CommandName 'gip' -ScriptBlock {
    param($wordToComplete, $commandAst, $cursorPosition)

    $commandElements = $commandAst.CommandElements
    $command = @(
        'gip'
        for ($i = 1; $i -lt $commandElements.Count; $i++) {
            $element = $commandElements[$i]
            if ($element -isnot [StringConstantExpressionAst] -or
                $element.StringConstantType -ne [StringConstantType]::BareWord -or
                $element.Value.StartsWith('-') -or
                $element.Value -eq $wordToComplete) {
                break
        }
        $element.Value
    }) -join ';'

    $completions = @(switch ($command) {
        'gip' {
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('encode', 'encode', [CompletionResultType]::ParameterValue, 'Encodes a picture as a .gip file')
            [CompletionResult]::new('decode', 'decode', [CompletionResultType]::ParameterValue, 'Decodes a .gip file to a picture')
            [CompletionResult]::new('batch', 'batch', [CompletionResultType]::ParameterValue, 'Encodes or decodes many files and whole folders, one picture per core')
            [CompletionResult]::new('info', 'info', [CompletionResultType]::ParameterValue, 'Shows what .gip files contain')
            [CompletionResult]::new('compare', 'compare', [CompletionResultType]::ParameterValue, 'Measures how much two pictures differ')
            [CompletionResult]::new('prefix', 'prefix', [CompletionResultType]::ParameterValue, 'Cuts a small .gip file from the beginning of a large one')
            [CompletionResult]::new('transform', 'transform', [CompletionResultType]::ParameterValue, 'Turns, mirrors or crops a .gip file without encoding it again')
            [CompletionResult]::new('export', 'export', [CompletionResultType]::ParameterValue, 'Writes the Gaussians of a .gip file for other programs')
            [CompletionResult]::new('import', 'import', [CompletionResultType]::ParameterValue, 'Makes a .gip file of Gaussians of other programs, or of what `gip export` writes')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'gip;encode' {
            [CompletionResult]::new('--gaussians', '--gaussians', [CompletionResultType]::ParameterName, 'At most N Gaussians, from 1 to 4194304')
            [CompletionResult]::new('--bpp', '--bpp', [CompletionResultType]::ParameterName, 'A file of at most B bits per pixel, from 0.000001 to 1000000')
            [CompletionResult]::new('--bytes', '--bytes', [CompletionResultType]::ParameterName, 'A file of at most N bytes, from 1 to 1073741824')
            [CompletionResult]::new('--psnr', '--psnr', [CompletionResultType]::ParameterName, 'A PSNR of the decoded file without its texture of DB decibels, from 1 to 120')
            [CompletionResult]::new('--quality', '--quality', [CompletionResultType]::ParameterName, 'A visual quality from 0 (smallest) to 100 (best), on the scale of SSIMULACRA2, of the picture without its texture; no more than 97 is aimed at [default: 75]')
            [CompletionResult]::new('--lambda', '--lambda', [CompletionResultType]::ParameterName, 'A Lagrange multiplier from 0.01 to 1000000: the squared error that a bit must save, where samples are 0 to 255. For comparisons over many pictures')
            [CompletionResult]::new('--tune', '--tune', [CompletionResultType]::ParameterName, 'What to minimize for the size of the file')
            [CompletionResult]::new('--effort', '--effort', [CompletionResultType]::ParameterName, 'Time to spend, from 1 (least) to 7 (most)')
            [CompletionResult]::new('--texture', '--texture', [CompletionResultType]::ParameterName, 'Strength of the texture, from 0 (none) to 100: with 50, about as strong as in the picture. It takes the place of fine irregular detail that the file has no bits for, such as sand, water and leaves. Files of --tune psnr and of the packed coding have none')
            [CompletionResult]::new('--first-layer', '--first-layer', [CompletionResultType]::ParameterName, 'Let the first layer make a file of at most N bytes, from 80 to 65536, as a placeholder: `gip prefix` cuts it off. Colour space, ICC profile and orientation are in it; all other metadata are stored after it. Not with --precision packed or f32, whose layers have the usual size')
            [CompletionResult]::new('--precision', '--precision', [CompletionResultType]::ParameterName, 'How the Gaussians are stored')
            [CompletionResult]::new('--seed', '--seed', [CompletionResultType]::ParameterName, 'Seed of the random numbers; the same picture, options and seed give the same file')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits')
            [CompletionResult]::new('--metadata', '--metadata', [CompletionResultType]::ParameterName, 'Which metadata is kept [default: all, but safe for the thumbnails of gip batch]')
            [CompletionResult]::new('--threads', '--threads', [CompletionResultType]::ParameterName, 'Number of threads, from 1 to 1024; the result does not depend on it [default: one per core]')
            [CompletionResult]::new('--keep-invisible', '--keep-invisible', [CompletionResultType]::ParameterName, 'Keep colours where alpha is 0. By default what does not show takes the colours around it: the file is smaller, and scaled pictures have no fringes')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Write OUTPUT even if its name does not end in .gip')
            [CompletionResult]::new('--allow-partial', '--allow-partial', [CompletionResultType]::ParameterName, 'If INPUT is truncated or damaged, encode what can be read of it, and print a warning, instead of failing')
            [CompletionResult]::new('--preserve-times', '--preserve-times', [CompletionResultType]::ParameterName, 'Give the result the times of its source: of the last change and the last access, as cp does with --preserve=timestamps')
            [CompletionResult]::new('--json', '--json', [CompletionResultType]::ParameterName, 'Print the report as one JSON object. It goes to standard error if OUTPUT is `-`')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'gip;decode' {
            [CompletionResult]::new('--scale', '--scale', [CompletionResultType]::ParameterName, 'Render F times as wide and high, from 0.001 to 1000. The Gaussians themselves are scaled; no pixels are resampled')
            [CompletionResult]::new('--size', '--size', [CompletionResultType]::ParameterName, 'Render the whole picture at W by H pixels, which it has when it is upright')
            [CompletionResult]::new('--fit', '--fit', [CompletionResultType]::ParameterName, 'Render the whole picture as large as fits into SIZE: one number for both sides, or WxH')
            [CompletionResult]::new('--region', '--region', [CompletionResultType]::ParameterName, 'Render only a region: the W by H pixels whose first one is (X, Y). Coordinates are pixels of the upright output, after --scale, --size or --fit')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'The format of OUTPUT, as an extension, whatever the name of OUTPUT is')
            [CompletionResult]::new('--metadata', '--metadata', [CompletionResultType]::ParameterName, 'Which metadata is kept [default: all, but safe for the thumbnails of gip batch]')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits')
            [CompletionResult]::new('--threads', '--threads', [CompletionResultType]::ParameterName, 'Number of threads, from 1 to 1024; the result does not depend on it [default: one per core]')
            [CompletionResult]::new('--no-texture', '--no-texture', [CompletionResultType]::ParameterName, 'Leave out the picture''s texture: the noise in place of sand, water or leaves. The picture is then smoother, and nearer to the source sample by sample')
            [CompletionResult]::new('--allow-partial', '--allow-partial', [CompletionResultType]::ParameterName, 'If the file is truncated or damaged, write the picture of the Gaussians that can be decoded, and print a warning, instead of failing')
            [CompletionResult]::new('--preserve-times', '--preserve-times', [CompletionResultType]::ParameterName, 'Give the result the times of its source: of the last change and the last access, as cp does with --preserve=timestamps')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'gip;batch' {
            [CompletionResult]::new('--out', '--out', [CompletionResultType]::ParameterName, 'The folder of the results; it is made if there is none')
            [CompletionResult]::new('--include', '--include', [CompletionResultType]::ParameterName, 'Take only files that match GLOB, or any of several when given again: a pattern as in .gitignore, of the path below INPUT. Upper and lower case are the same')
            [CompletionResult]::new('--exclude', '--exclude', [CompletionResultType]::ParameterName, 'Leave out files and folders that match GLOB, even if --include takes them; may be given again')
            [CompletionResult]::new('--jobs', '--jobs', [CompletionResultType]::ParameterName, 'Number of pictures that are worked on at the same time, from 1 to 1024; each takes one thread [default: one per core]')
            [CompletionResult]::new('--budget', '--budget', [CompletionResultType]::ParameterName, 'Most megapixels that are worked on at the same time, from 0.001 to 1000000 [default: 16 for each job]')
            [CompletionResult]::new('--shards', '--shards', [CompletionResultType]::ParameterName, 'Write tar files of N pictures each, as WebDataset reads them, in place of a file per picture: DIR/000000.tar and so on, from 1 to 1000000')
            [CompletionResult]::new('--manifest', '--manifest', [CompletionResultType]::ParameterName, 'Write a line of JSON for every file to FILE, or to standard output if it is `-`')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits')
            [CompletionResult]::new('--thumbnail', '--thumbnail', [CompletionResultType]::ParameterName, 'Decode .gip files to thumbnails that fit into SIZE: one number for both sides, or WxH')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'The format of decoded pictures, as an extension: png, tif, webp, jpg, bmp, tga, qoi, gif, ico, ff, pgm, ppm, pnm or pam')
            [CompletionResult]::new('--metadata', '--metadata', [CompletionResultType]::ParameterName, 'Which metadata is kept [default: all, but safe for the thumbnails of gip batch]')
            [CompletionResult]::new('--gaussians', '--gaussians', [CompletionResultType]::ParameterName, 'At most N Gaussians, from 1 to 4194304')
            [CompletionResult]::new('--bpp', '--bpp', [CompletionResultType]::ParameterName, 'A file of at most B bits per pixel, from 0.000001 to 1000000')
            [CompletionResult]::new('--bytes', '--bytes', [CompletionResultType]::ParameterName, 'A file of at most N bytes, from 1 to 1073741824')
            [CompletionResult]::new('--psnr', '--psnr', [CompletionResultType]::ParameterName, 'A PSNR of the decoded file without its texture of DB decibels, from 1 to 120')
            [CompletionResult]::new('--quality', '--quality', [CompletionResultType]::ParameterName, 'A visual quality from 0 (smallest) to 100 (best), on the scale of SSIMULACRA2, of the picture without its texture; no more than 97 is aimed at [default: 75]')
            [CompletionResult]::new('--lambda', '--lambda', [CompletionResultType]::ParameterName, 'A Lagrange multiplier from 0.01 to 1000000: the squared error that a bit must save, where samples are 0 to 255. For comparisons over many pictures')
            [CompletionResult]::new('--tune', '--tune', [CompletionResultType]::ParameterName, 'What to minimize for the size of the file')
            [CompletionResult]::new('--effort', '--effort', [CompletionResultType]::ParameterName, 'Time to spend, from 1 (least) to 7 (most)')
            [CompletionResult]::new('--texture', '--texture', [CompletionResultType]::ParameterName, 'Strength of the texture, from 0 (none) to 100: with 50, about as strong as in the picture. It takes the place of fine irregular detail that the file has no bits for, such as sand, water and leaves. Files of --tune psnr and of the packed coding have none')
            [CompletionResult]::new('--first-layer', '--first-layer', [CompletionResultType]::ParameterName, 'Let the first layer make a file of at most N bytes, from 80 to 65536, as a placeholder: `gip prefix` cuts it off. Colour space, ICC profile and orientation are in it; all other metadata are stored after it. Not with --precision packed or f32, whose layers have the usual size')
            [CompletionResult]::new('--precision', '--precision', [CompletionResultType]::ParameterName, 'How the Gaussians are stored')
            [CompletionResult]::new('--seed', '--seed', [CompletionResultType]::ParameterName, 'Seed of the random numbers; the same picture, options and seed give the same file')
            [CompletionResult]::new('--resume', '--resume', [CompletionResultType]::ParameterName, 'Skip files whose result is whole and newer than they are')
            [CompletionResult]::new('--allow-partial', '--allow-partial', [CompletionResultType]::ParameterName, 'Take what can be read of a file that is truncated or damaged, with a warning, instead of failing with it. `gip encode --help` says for which formats damage in the middle goes unnoticed')
            [CompletionResult]::new('--decode', '--decode', [CompletionResultType]::ParameterName, 'Decode .gip files; of a folder, only these are taken')
            [CompletionResult]::new('--no-texture', '--no-texture', [CompletionResultType]::ParameterName, 'Leave out the texture of decoded pictures: the noise in place of sand, water or leaves')
            [CompletionResult]::new('--preserve-times', '--preserve-times', [CompletionResultType]::ParameterName, 'Give the result the times of its source: of the last change and the last access, as cp does with --preserve=timestamps')
            [CompletionResult]::new('--keep-invisible', '--keep-invisible', [CompletionResultType]::ParameterName, 'Keep colours where alpha is 0. By default what does not show takes the colours around it: the file is smaller, and scaled pictures have no fringes')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'gip;info' {
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits')
            [CompletionResult]::new('--json', '--json', [CompletionResultType]::ParameterName, 'Print one JSON object for each file, on a line of its own: the name and the size of the file, all fields of the header, number and bytes of the chunks of each type, bits per Gaussian by attribute, and sizes of the metadata')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'gip;compare' {
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits')
            [CompletionResult]::new('--keep-invisible', '--keep-invisible', [CompletionResultType]::ParameterName, 'Count colours as they are stored, where alpha is 0, too')
            [CompletionResult]::new('--json', '--json', [CompletionResultType]::ParameterName, 'Print one JSON object: width, height, channels, depth (bits per sample), psnr (in dB), ms_ssim, max_abs_error (in quantization steps of that depth). The PSNR of identical pictures, which is infinite, is given as 999')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'gip;prefix' {
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Write OUTPUT even if its name does not end in .gip')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'gip;transform' {
            [CompletionResult]::new('--crop', '--crop', [CompletionResultType]::ParameterName, 'Keep only the W by H pixels whose first one is (X, Y), in pixels of the upright picture')
            [CompletionResult]::new('--rotate', '--rotate', [CompletionResultType]::ParameterName, 'Rotate clockwise by so many degrees')
            [CompletionResult]::new('--flip', '--flip', [CompletionResultType]::ParameterName, 'Mirror the picture')
            [CompletionResult]::new('--metadata', '--metadata', [CompletionResultType]::ParameterName, 'Which metadata is kept [default: all, but safe for the thumbnails of gip batch]')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits')
            [CompletionResult]::new('--threads', '--threads', [CompletionResultType]::ParameterName, 'Number of threads, from 1 to 1024; the result does not depend on it [default: one per core]')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Write OUTPUT even if its name does not end in .gip')
            [CompletionResult]::new('--preserve-times', '--preserve-times', [CompletionResultType]::ParameterName, 'Give the result the times of its source: of the last change and the last access, as cp does with --preserve=timestamps')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'gip;export' {
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'The format, in place of the one that the extension of OUTPUT names')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'gip;import' {
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'The format, in place of the one that the extension of INPUT names')
            [CompletionResult]::new('--precision', '--precision', [CompletionResultType]::ParameterName, 'How the Gaussians are stored')
            [CompletionResult]::new('--bits', '--bits', [CompletionResultType]::ParameterName, 'Bit depths of position, shape and colour with --precision packed, each from 1 to 16 [default: 12,10,6]')
            [CompletionResult]::new('--color-step', '--color-step', [CompletionResultType]::ParameterName, 'Step of colour with --precision entropy, from 0.000001 to 1000: the difference of the amplitudes of neighbouring codes, where 1 is a full sample, times the Gaussian''s size in pixels. Stronger ones are finer in position and shape as well [default: 0.02]')
            [CompletionResult]::new('--parameterization', '--parameterization', [CompletionResultType]::ParameterName, 'What is stored of a shape, unless with --precision entropy')
            [CompletionResult]::new('--size', '--size', [CompletionResultType]::ParameterName, 'Size of the picture in pixels, in which centres and covariances are')
            [CompletionResult]::new('--depth', '--depth', [CompletionResultType]::ParameterName, 'Bits per sample, 8 or 16')
            [CompletionResult]::new('--kernel', '--kernel', [CompletionResultType]::ParameterName, 'The weight of a Gaussian around its centre')
            [CompletionResult]::new('--cutoff', '--cutoff', [CompletionResultType]::ParameterName, 'The largest squared Mahalanobis distance with a weight over 0, of the exponential kernel: over 0, at most 64 [default: 11.082527, where the weight is 1/255]')
            [CompletionResult]::new('--base-color', '--base-color', [CompletionResultType]::ParameterName, 'The colour that the Gaussians are added to: a sample for all channels, or one for each, from 0 to 255, or to 65535 with 16 bits')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Allow what takes more than by default, or less: NAME=VALUE, where NAME is width, height or pixels (of pictures that are read or written), gaussians, memory (in bytes) or work (kernel evaluations of a rendering beyond 64 for each pixel); or `none` for no limits')
            [CompletionResult]::new('--threads', '--threads', [CompletionResultType]::ParameterName, 'Number of threads, from 1 to 1024; the result does not depend on it [default: one per core]')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Write OUTPUT even if its name does not end in .gip')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'gip;help' {
            [CompletionResult]::new('encode', 'encode', [CompletionResultType]::ParameterValue, 'Encodes a picture as a .gip file')
            [CompletionResult]::new('decode', 'decode', [CompletionResultType]::ParameterValue, 'Decodes a .gip file to a picture')
            [CompletionResult]::new('batch', 'batch', [CompletionResultType]::ParameterValue, 'Encodes or decodes many files and whole folders, one picture per core')
            [CompletionResult]::new('info', 'info', [CompletionResultType]::ParameterValue, 'Shows what .gip files contain')
            [CompletionResult]::new('compare', 'compare', [CompletionResultType]::ParameterValue, 'Measures how much two pictures differ')
            [CompletionResult]::new('prefix', 'prefix', [CompletionResultType]::ParameterValue, 'Cuts a small .gip file from the beginning of a large one')
            [CompletionResult]::new('transform', 'transform', [CompletionResultType]::ParameterValue, 'Turns, mirrors or crops a .gip file without encoding it again')
            [CompletionResult]::new('export', 'export', [CompletionResultType]::ParameterValue, 'Writes the Gaussians of a .gip file for other programs')
            [CompletionResult]::new('import', 'import', [CompletionResultType]::ParameterValue, 'Makes a .gip file of Gaussians of other programs, or of what `gip export` writes')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'gip;help;encode' {
            break
        }
        'gip;help;decode' {
            break
        }
        'gip;help;batch' {
            break
        }
        'gip;help;info' {
            break
        }
        'gip;help;compare' {
            break
        }
        'gip;help;prefix' {
            break
        }
        'gip;help;transform' {
            break
        }
        'gip;help;export' {
            break
        }
        'gip;help;import' {
            break
        }
        'gip;help;help' {
            break
        }
    })

    $completions.Where{ $_.CompletionText -like "$wordToComplete*" } |
        Sort-Object -Property ListItemText
}
