//! Whole buffers, written by hand after the kernel's userspace-api/media/v4l.

use proptest::prelude::*;

use super::*;

fn layout(code: &str, rows: usize, columns: usize, stride: usize) -> Layout {
    let format = PixelFormat::from_four_cc(code.parse().unwrap()).unwrap();
    Layout { format, rows, columns, stride, bayer: BayerUse::Green }
}

fn narrow(values: &[u8]) -> Samples {
    Samples::U8(values.to_vec())
}

fn wide(values: &[u16]) -> Samples {
    Samples::U16(values.to_vec())
}

#[test]
fn padding_and_what_follows_the_image_are_left_out() {
    let frame = layout("GREY", 2, 3, 4).decode(&[1, 2, 3, 99, 4, 5, 6, 99, 99]).unwrap();
    assert_eq!(frame, Frame::new(2, 3, 8, narrow(&[1, 2, 3, 4, 5, 6])).unwrap());
    let frame = layout("Y10", 2, 1, 4).decode(&[0xff, 0x03, 99, 99, 0x01, 0x02, 99, 99]).unwrap();
    assert_eq!(frame, Frame::new(2, 1, 10, wide(&[0x3ff, 0x201])).unwrap());
}

#[test]
fn words_of_every_depth_and_order() {
    for (code, depth, bytes, truth) in [
        ("Y12", 12, [0xbc, 0x0a, 0xff, 0x0f], [0xabc, 0xfff]),
        ("Y14", 14, [0xff, 0x3f, 0x01, 0x20], [0x3fff, 0x2001]),
        ("Y16", 16, [0x34, 0x12, 0xff, 0xff], [0x1234, 0xffff]),
        ("Y16-BE", 16, [0x12, 0x34, 0x00, 0xff], [0x1234, 0x00ff]),
    ] {
        let frame = layout(code, 1, 2, 4).decode(&bytes).unwrap();
        assert_eq!(frame, Frame::new(1, 2, depth, wide(&truth)).unwrap(), "{code}");
    }
}

#[test]
fn packed_rows_start_at_their_stride() {
    // 0x201 and 0x102 in each row, with a byte between the rows.
    let y10b = [0b1000_0000, 0b0101_0000, 0b0010_0000, 99, 0b1000_0000, 0b0101_0000, 0b0010_0000, 99];
    let y12p = [0x20, 0x10, 0x21, 99, 0x20, 0x10, 0x21, 99];
    for (code, depth, bytes) in [("Y10B", 10, y10b), ("Y12P", 12, y12p)] {
        let frame = layout(code, 2, 2, 4).decode(&bytes).unwrap();
        assert_eq!(frame, Frame::new(2, 2, depth, wide(&[0x201, 0x102, 0x201, 0x102])).unwrap(), "{code}");
    }
}

#[test]
fn only_luma_is_taken() {
    // 1 2 3 over 4 5 6 are luma, the rest chroma or padding.
    let luma_first = [1, 90, 2, 91, 3, 92, 0, 93, 4, 90, 5, 91, 6, 92, 0, 93];
    let chroma_first = [90, 1, 91, 2, 92, 3, 93, 0, 90, 4, 91, 5, 92, 6, 93, 0];
    for (codes, bytes) in [(["YUYV", "YVYU"], luma_first), (["UYVY", "VYUY"], chroma_first)] {
        for code in codes {
            let frame = layout(code, 2, 3, 8).decode(&bytes).unwrap();
            assert_eq!(*frame.samples(), narrow(&[1, 2, 3, 4, 5, 6]), "{code}");
        }
    }
    for (code, chroma) in [("NV12", 4), ("YU12", 4), ("NV16", 8), ("422P", 8), ("NV42", 16)] {
        let mut bytes = vec![1, 2, 3, 99, 4, 5, 6, 99];
        bytes.resize(8 + chroma, 99);
        let planar = layout(code, 2, 3, 4);
        assert_eq!(*planar.decode(&bytes).unwrap().samples(), narrow(&[1, 2, 3, 4, 5, 6]), "{code}");
        let short = PixelError::TooShort { expected: bytes.len(), found: bytes.len() - 1 };
        assert_eq!(planar.decode(&bytes[1..]), Err(short), "chroma that was lost, {code}");
    }
}

/// Rows of the mosaic: 1 2 3 4 over 10 20 30 40, with a fifth column and a third row to be dropped.
const MOSAIC: [u8; 15] = [1, 2, 3, 4, 255, 10, 20, 30, 40, 255, 255, 255, 255, 255, 255];

#[test]
fn cells_of_a_mosaic_are_summed() {
    for (code, greens) in
        [("BA81", [12, 34]), ("RGGB", [12, 34]), ("GBRG", [1 + 20, 3 + 40]), ("GRBG", [1 + 20, 3 + 40])]
    {
        let green = layout(code, 3, 5, 5);
        assert_eq!(green.frame_shape(), (1, 2, 9));
        assert_eq!(green.decode(&MOSAIC).unwrap(), Frame::new(1, 2, 9, wide(&greens)).unwrap(), "{code}");
        let binned = Layout { bayer: BayerUse::Binned, ..green };
        assert_eq!(binned.frame_shape(), (1, 2, 10));
        assert_eq!(binned.decode(&MOSAIC).unwrap(), Frame::new(1, 2, 10, wide(&[33, 77])).unwrap(), "{code}");
    }
}

#[test]
fn deep_mosaics_keep_their_bits_until_sixteen() {
    let words = |values: [u16; 4]| values.map(u16::to_le_bytes).concat();
    for (code, values, green, binned) in [
        ("RG10", [1023, 1023, 1023, 1023], (11, 2046), (12, 4092)),
        ("BG12", [4095, 4095, 4095, 4095], (13, 8190), (14, 16380)),
        ("RG14", [16383, 16383, 16383, 16383], (15, 32766), (16, 65532)),
        // 2 + 3 = 5, halved 2.5, rounded 3; 1 + 2 + 3 + 4 = 10, a quarter 2.5, rounded 3.
        ("RG16", [1, 2, 3, 4], (16, 3), (16, 3)),
        ("BYR2", [65535, 65535, 65535, 65535], (16, 65535), (16, 65535)),
    ] {
        for (bayer, (depth, sum)) in [(BayerUse::Green, green), (BayerUse::Binned, binned)] {
            let cell = Layout { bayer, ..layout(code, 2, 2, 4) };
            assert_eq!(
                cell.decode(&words(values)).unwrap(),
                Frame::new(1, 1, depth, wide(&[sum])).unwrap(),
                "{code}"
            );
        }
    }
    // pgCC: G R / B G; greens 0x123 and 0xabc.
    let packed = layout("pgCC", 2, 2, 3).decode(&[0x12, 0xff, 0xf3, 0xff, 0xab, 0xcf]).unwrap();
    assert_eq!(packed, Frame::new(1, 1, 13, wide(&[0x123 + 0xabc])).unwrap());
}

#[test]
fn bits_above_the_depth_are_an_error() {
    let format = |code: &str| layout(code, 1, 1, 2).format;
    let grey = layout("Y10", 1, 2, 4).decode(&[0, 0, 0x00, 0x04]).unwrap_err();
    assert_eq!(grey, PixelError::AboveDepth { format: format("Y10"), maximum: 1024 });
    assert!(grey.to_string().contains("format Y10, which has 10 bit"), "{grey}");
    // The sum 0x400 + 0 would fit the 11 bit of the result.
    let mosaic = layout("RG10", 2, 2, 4).decode(&[0, 0, 0x00, 0x04, 0, 0, 0, 0]).unwrap_err();
    assert_eq!(mosaic, PixelError::AboveDepth { format: format("RG10"), maximum: 1024 });
}

#[test]
fn layouts_that_cannot_be_are_errors() {
    assert!(matches!(
        layout("Y12", 2, 3, 5).decode(&[0; 99]),
        Err(PixelError::Stride { least: 6, found: 5, .. })
    ));
    assert!(matches!(layout("GREY", 0, 3, 3).decode(&[0; 99]), Err(PixelError::Empty { .. })));
    assert!(matches!(layout("GREY", 3, 0, 0).decode(&[0; 99]), Err(PixelError::Empty { .. })));
    assert!(matches!(layout("RGGB", 1, 9, 9).decode(&[0; 99]), Err(PixelError::Empty { .. })));
    assert!(matches!(
        layout("NV24", usize::MAX, 2, usize::MAX).decode(&[0; 99]),
        Err(PixelError::TooShort { .. })
    ));
}

fn any_format() -> impl Strategy<Value = PixelFormat> {
    proptest::sample::select(PixelFormat::all().collect::<Vec<_>>())
}

fn any_use() -> impl Strategy<Value = BayerUse> {
    proptest::sample::select(vec![BayerUse::Green, BayerUse::Binned])
}

proptest! {
    #[test]
    fn any_bytes_give_a_frame_of_the_stated_shape_or_an_error(
        format in any_format(),
        bayer in any_use(),
        rows in 0_usize..9,
        columns in 0_usize..19,
        padding in 0_usize..4,
        bytes in proptest::collection::vec(any::<u8>(), 0..700),
    ) {
        let least = format.least_stride(columns);
        let layout = Layout { format, rows, columns, stride: least.unwrap_or(0) + padding, bayer };
        let result = layout.decode(&bytes);
        let needed = format.image_bytes(rows, layout.stride);
        if needed.is_none_or(|needed| bytes.len() < needed) {
            prop_assert!(result.is_err());
        }
        if let Ok(frame) = result {
            prop_assert_eq!((frame.rows(), frame.columns(), frame.bit_depth()), layout.frame_shape());
        }
    }

    #[test]
    fn any_layout_gives_a_frame_or_an_error(
        format in any_format(),
        rows: usize,
        columns: usize,
        stride: usize,
        bytes in proptest::collection::vec(any::<u8>(), 0..40),
    ) {
        let layout = Layout { format, rows, columns, stride, bayer: BayerUse::Green };
        prop_assert!(layout.decode(&bytes).is_err() || rows.min(columns) <= bytes.len());
    }
}
