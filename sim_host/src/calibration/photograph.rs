//! Photographs: JPEG besides what [`GreyImage`] reads.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, anyhow};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::image_file::GreyImage;

/// Longest side of a photograph, px: what `GreyImage` takes.
const MAX_SIDE: usize = 8192;

/// Reads a JPEG, PNG or PGM file as grey values. The error is one line that names the file.
pub fn read(path: &Path) -> Result<GreyImage> {
    let bytes = fs::read(path).with_context(|| format!("image {}: cannot be read", path.display()))?;
    let image = if bytes.starts_with(b"\xff\xd8") {
        from_jpeg(&bytes)
    } else {
        GreyImage::from_bytes(&bytes)
    };
    image.with_context(|| format!("image {}", path.display()))
}

fn from_jpeg(bytes: &[u8]) -> Result<GreyImage> {
    let options = DecoderOptions::default()
        .jpeg_set_out_colorspace(ColorSpace::Luma)
        .set_max_width(MAX_SIDE)
        .set_max_height(MAX_SIDE)
        .set_strict_mode(true);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    let pixels = decoder.decode().map_err(|error| anyhow!("damaged JPEG: {error:?}"))?;
    let (width, height) = decoder.dimensions().context("damaged JPEG: no size")?;
    Ok(GreyImage { width, height, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEFT: &[u8] = include_bytes!("testdata/left01.jpg");

    #[test]
    fn a_jpeg_is_read_as_grey_values() {
        let image = from_jpeg(LEFT).expect("readable");
        assert_eq!((image.width, image.height, image.pixels.len()), (640, 480, 640 * 480));
        // Mean of cv2.imread(…, 0) of opencv-python-headless 5.0.0.
        let mean = image.pixels.iter().map(|value| f64::from(*value)).sum::<f64>() / image.pixels.len() as f64;
        assert!((mean - 116.560).abs() < 0.05, "{mean}");
    }

    #[test]
    fn a_missing_and_a_truncated_photograph_are_refused_by_name() {
        let missing = read(Path::new("no/such.jpg")).expect_err("there is none");
        assert!(
            format!("{missing:#}").starts_with("image no/such.jpg: cannot be read: "),
            "{missing:#}"
        );
        let cut = from_jpeg(&LEFT[..LEFT.len() / 2]).expect_err("half a file");
        assert!(format!("{cut:#}").starts_with("damaged JPEG: "), "{cut:#}");
        assert!(from_jpeg(&LEFT[..20]).is_err());
    }
}
