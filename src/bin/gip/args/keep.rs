//! What of a source is kept beside its pixels.

use clap::ValueEnum;
use image_gip::MetadataPolicy;

#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct Keep {
    /// Which metadata is kept [default: all, but safe for the thumbnails of gip batch].
    #[arg(long, value_name = "WHICH", value_enum)]
    metadata: Option<PolicyArg>,
    /// Give the result the times of its source: of the last change and the last access, as cp does with
    /// --preserve=timestamps.
    #[arg(long)]
    pub(crate) preserve_times: bool,
}

impl Keep {
    /// Which metadata is kept, if that was asked for.
    pub(crate) fn policy(self) -> Option<MetadataPolicy> {
        self.metadata.map(MetadataPolicy::from)
    }
}

/// Which metadata is kept.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum PolicyArg {
    /// All of it, as it is
    All,
    /// Colours, orientation, title, description, artist, copyright and dates; no position, maker
    /// notes, embedded thumbnails, cameras, serial numbers, owners, comments or anything unknown
    Safe,
    /// Only the colour space in codes (cICP), not even a colour profile
    None,
}

impl From<PolicyArg> for MetadataPolicy {
    fn from(arg: PolicyArg) -> Self {
        match arg {
            PolicyArg::All => Self::All,
            PolicyArg::Safe => Self::Safe,
            PolicyArg::None => Self::None,
        }
    }
}
