//! Camera frames as files: 8-bit grey, read from PNG of any kind and from PGM, written as PNG.
//!
//! Which of the two a file is its first bytes say, not its name. Colour becomes luma, 16 bits become 8, transparency is
//! left out: a camera has none.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};

/// Longest side of an image that is read, px: far over any camera here, and far under what would fill the memory.
const MAX_SIDE: u32 = 8192;

/// An 8-bit grey image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GreyImage {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row by row from the top left; 0 black, 255 white; `width * height` long.
    pub pixels: Vec<u8>,
}

impl GreyImage {
    /// Reads the PNG or PGM file `path`. The error is one line that names it.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = fs::read(path).with_context(|| format!("image {}: cannot be read", path.display()))?;
        Self::from_bytes(&bytes).with_context(|| format!("image {}", path.display()))
    }

    /// Reads a PNG or PGM from memory.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        if bytes.starts_with(b"\x89PNG") {
            from_png(bytes)
        } else if bytes.starts_with(b"P5") || bytes.starts_with(b"P2") {
            from_pgm(bytes)
        } else {
            bail!("neither PNG nor PGM (P2 or P5)")
        }
    }

    /// The image as a PNG file.
    pub fn to_png(&self) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, u32::try_from(self.width)?, u32::try_from(self.height)?);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Eight);
        encoder
            .write_header()?
            .write_image_data(&self.pixels)
            .context("image: pixels do not fill its rows")?;
        Ok(bytes)
    }
}

fn check_size(width: u32, height: u32) -> Result<()> {
    for (name, side) in [("width", width), ("height", height)] {
        ensure!(
            (1..=MAX_SIDE).contains(&side),
            "{name} {side} px: must be 1 to {MAX_SIDE}"
        );
    }
    Ok(())
}

fn from_png(bytes: &[u8]) -> Result<GreyImage> {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    // Palettes and 1, 2, 4 bits become 8; so do 16.
    decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
    let (width, height) = decoder.read_header_info().context("damaged PNG")?.size();
    check_size(width, height)?;
    let mut reader = decoder.read_info().context("damaged PNG")?;
    let mut data = vec![0; reader.output_buffer_size().context("PNG too large")?];
    let frame = reader.next_frame(&mut data).context("damaged PNG")?;
    data.truncate(frame.buffer_size());
    let pixels = match frame.color_type.samples() {
        1 => data,
        2 => data.chunks_exact(2).map(|grey_alpha| grey_alpha[0]).collect(),
        samples => data.chunks_exact(samples).map(luma).collect(),
    };
    Ok(GreyImage {
        width: width as usize,
        height: height as usize,
        pixels,
    })
}

/// Luma of red, green, blue, by ITU-R BT.601: 0.299, 0.587, 0.114.
fn luma(rgb: &[u8]) -> u8 {
    let sum = 299 * rgb[0] as u32 + 587 * rgb[1] as u32 + 114 * rgb[2] as u32;
    ((sum + 500) / 1000) as u8
}

fn from_pgm(bytes: &[u8]) -> Result<GreyImage> {
    let mut rest = &bytes[2..];
    let width = number(&mut rest).context("damaged PGM: no width")?;
    let height = number(&mut rest).context("damaged PGM: no height")?;
    check_size(width, height)?;
    let white = number(&mut rest).context("damaged PGM: no largest value")?;
    ensure!(
        (1..=65535).contains(&white),
        "largest value {white}: must be 1 to 65535"
    );
    let count = width as usize * height as usize;
    let samples: Vec<u32> = if bytes.starts_with(b"P2") {
        std::iter::from_fn(|| number(&mut rest)).take(count).collect()
    } else {
        rest = rest.get(1..).unwrap_or(&[]); // the one white space that ends the header
        match white {
            ..256 => rest.iter().take(count).map(|byte| *byte as u32).collect(),
            _ => rest
                .chunks_exact(2)
                .take(count)
                .map(|pair| u16::from_be_bytes([pair[0], pair[1]]) as u32)
                .collect(),
        }
    };
    ensure!(
        samples.len() == count,
        "truncated PGM: {} of {count} pixels",
        samples.len()
    );
    if let Some(sample) = samples.iter().find(|sample| **sample > white) {
        bail!("pixel value {sample}: must be 0 to {white}");
    }
    let pixels = samples
        .into_iter()
        .map(|sample| ((sample * 255 + white / 2) / white) as u8)
        .collect();
    Ok(GreyImage {
        width: width as usize,
        height: height as usize,
        pixels,
    })
}

/// Takes a decimal number off the front, after white space and comments (`# …` to the end of the line).
fn number(rest: &mut &[u8]) -> Option<u32> {
    loop {
        *rest = rest.trim_ascii_start();
        if rest.first() != Some(&b'#') {
            break;
        }
        let end = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
        *rest = &rest[end..];
    }
    let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let (number, after) = rest.split_at(digits);
    *rest = after;
    std::str::from_utf8(number).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn encode(color: png::ColorType, depth: png::BitDepth, palette: Option<Vec<u8>>, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(color);
        encoder.set_depth(depth);
        if let Some(palette) = palette {
            encoder.set_palette(palette);
        }
        encoder
            .write_header()
            .and_then(|mut writer| writer.write_image_data(data))
            .expect("encoded");
        bytes
    }

    fn pixels(bytes: &[u8]) -> Vec<u8> {
        let image = GreyImage::from_bytes(bytes).expect("readable");
        assert_eq!((image.width, image.height), (2, 1));
        image.pixels
    }

    fn error(bytes: &[u8]) -> String {
        format!("{:#}", GreyImage::from_bytes(bytes).expect_err("not an image"))
    }

    #[test]
    fn every_kind_of_png_becomes_8_bit_grey() {
        use png::{BitDepth as Depth, ColorType as Color};
        assert_eq!(
            pixels(&encode(Color::Grayscale, Depth::Eight, None, &[7, 200])),
            [7, 200]
        );
        assert_eq!(
            pixels(&encode(Color::Grayscale, Depth::One, None, &[0b0100_0000])),
            [0, 255]
        );
        assert_eq!(
            pixels(&encode(Color::Grayscale, Depth::Sixteen, None, &[7, 255, 200, 0])),
            [7, 200]
        );
        assert_eq!(
            pixels(&encode(Color::GrayscaleAlpha, Depth::Eight, None, &[7, 0, 200, 99])),
            [7, 200]
        );
        assert_eq!(
            pixels(&encode(Color::Rgb, Depth::Eight, None, &[255, 0, 0, 0, 255, 0])),
            [76, 150]
        );
        assert_eq!(
            pixels(&encode(Color::Rgba, Depth::Eight, None, &[0, 0, 255, 9, 9, 9, 9, 0])),
            [29, 9]
        );
        let palette = vec![10, 10, 10, 200, 200, 200];
        assert_eq!(
            pixels(&encode(Color::Indexed, Depth::Eight, Some(palette), &[1, 0])),
            [200, 10]
        );
    }

    #[test]
    fn pgm_is_read_as_text_or_bytes_with_comments_and_scaled_to_255() {
        assert_eq!(pixels(b"P2\n# a comment\n2 1 # another\n10\n0 10\n"), [0, 255]);
        assert_eq!(pixels(b"P5 2 1 255\n\x20\x0a"), [32, 10]);
        assert_eq!(pixels(b"P5\n2 1\n65535\n\x80\x00\xff\xff"), [128, 255]);
    }

    #[test]
    fn what_is_wrong_with_a_file_is_said_in_one_line() {
        assert_eq!(error(b"GIF89a"), "neither PNG nor PGM (P2 or P5)");
        assert_eq!(error(b"P5\n9000 2\n255\n"), "width 9000 px: must be 1 to 8192");
        assert_eq!(error(b"P5\n3 0\n255\n"), "height 0 px: must be 1 to 8192");
        assert_eq!(error(b"P5\n3 2\n70000\n"), "largest value 70000: must be 1 to 65535");
        assert_eq!(error(b"P5\n3 2\n255\nabc"), "truncated PGM: 3 of 6 pixels");
        assert_eq!(error(b"P2\n2 1\n9\n3 12"), "pixel value 12: must be 0 to 9");
        assert_eq!(error(b"P5\nx"), "damaged PGM: no width");
        let png = GreyImage {
            width: 2,
            height: 2,
            pixels: vec![1, 2, 3, 4],
        }
        .to_png()
        .expect("encoded");
        assert!(error(&png[..png.len() / 2]).starts_with("damaged PNG: "));
        let missing = GreyImage::read(Path::new("no/such.png")).expect_err("there is none");
        assert!(format!("{missing:#}").starts_with("image no/such.png: cannot be read: "));
    }

    proptest! {
        #[test]
        fn an_image_survives_png((width, height, pixels) in (1..40_usize, 1..40_usize).prop_flat_map(|(w, h)| {
            (Just(w), Just(h), prop::collection::vec(any::<u8>(), w * h))
        })) {
            let image = GreyImage { width, height, pixels };
            prop_assert_eq!(GreyImage::from_bytes(&image.to_png().unwrap()).unwrap(), image);
        }

        #[test]
        fn no_bytes_make_the_reader_panic(mut bytes in prop::collection::vec(any::<u8>(), 0..200), kind in 0..3_usize) {
            let front: &[u8] = [b"\x89PNG\r\n\x1a\n".as_slice(), b"P5 9 9 255 ", b"P2 2 2 "][kind];
            bytes.splice(0..0, front.iter().copied());
            let _ = GreyImage::from_bytes(&bytes);
        }
    }
}
