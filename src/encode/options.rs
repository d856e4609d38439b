//! Options of the encoder: the target of a file and the precision of its attributes.

/// The target that an encoded file has to meet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Target {
    /// A picture that a person accepts without looking twice: the same as `Quality(75.0)`.
    #[default]
    Auto,
    /// At most this many Gaussians, from 1 to 2^22. A picture that needs fewer gets fewer; of those of the
    /// fit, the entropy coding leaves out what is not worth its bits, but no more than half.
    Gaussians(u32),
    /// A file of at most this many bytes, from 1 to 2^30, and of at least 99 % of them. Where so many
    /// bytes bring hardly anything, the file is smaller. Where even a file without Gaussians has more
    /// bytes, that is the file. [`Report::shortfall`](crate::Report) says so in both cases.
    Bytes(u64),
    /// A file of at most this many bits per pixel, from 10^-6 to 10^6, and of at least 99 % of
    /// them. The whole file counts; see also [`Target::Bytes`].
    BitsPerPixel(f64),
    /// A PSNR of the decoded file without its texture in dB, at the source's depth, from 1 to 120: at least this much,
    /// and at most 0.05 dB more. A PSNR that is out of reach ends with what the effort reaches, after
    /// at most one Gaussian per pixel and three times the effort's iterations, and
    /// [`Report::shortfall`](crate::Report) says so.
    Psnr(f64),
    /// A visual quality from 0 to 100, on the scale of the metric SSIMULACRA2: about 30 is low, 50
    /// medium, 70 high, and from 90 on people see no difference. It is that of the picture without its texture,
    /// which the metric takes for an error. The encoder aims at its estimate of the metric, [`Report::quality`](crate::Report), and no higher than 97. It aims at more in two cases:
    /// where the picture is smooth, as in a gradient, so that there are no blotches; and where a side has
    /// less than 113 pixels. Of such a picture the metric says little, so a larger one, made of the
    /// picture and its mirror images, must have the quality as well. A picture whose [`Cicp`](crate::Cicp) says
    /// PQ is judged as a display of standard range shows it: the metric knows no other.
    Quality(f64),
    /// A Lagrange multiplier lambda from 0.01 to 10^6: with all files of a set at the same lambda, no
    /// bit would bring more in another one. It is the squared error that a bit must save, where
    /// samples are 0 to 255. It suits comparisons of codecs, which average over a set.
    Lambda(f64),
}

/// What the encoder minimizes for the size of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Tune {
    /// The error that a person sees. Squared errors count less where the picture varies, and more
    /// where they shift the means of small blocks of pixels.
    #[default]
    Visual,
    /// The squared error. It gives the highest PSNR.
    Psnr,
}

/// How the attributes of the Gaussians are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Precision {
    /// The packed coding with 32-bit floats: the trained values themselves, without quantization
    /// error (spec, sections 6 and 7.2).
    Float,
    /// The packed coding with codes of fixed bit depths, after quantization-aware training (spec,
    /// sections 6 and 7.2; paper, section "Compression Framework").
    Packed,
    /// The entropy coding, with codes chosen by rate-distortion optimization (spec, sections 7.3
    /// to 7.5). It gives the smallest files.
    Entropy,
}
