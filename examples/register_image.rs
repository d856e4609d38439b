//! Opens a `.gip` file through the `image` crate, which learns the format from one call.
//!
//!     cargo run --release --features image --example register_image -- photo.gip photo.png

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output] = arguments.as_slice() else {
        return Err("usage: register_image INPUT.gip OUTPUT.png".into());
    };
    // Once, before the first picture is opened.
    image_gip::register();

    let picture = image::open(input)?;
    println!("{input}: {}x{}, {:?}", picture.width(), picture.height(), picture.color());
    picture.save(output)?;
    Ok(())
}
