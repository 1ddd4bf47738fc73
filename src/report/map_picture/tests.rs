//! What a map's picture shows.

use super::*;

const WHITE: Rgb<u8> = Rgb([255, 255, 255]);

fn count(picture: &RgbImage, colour: [u8; 3]) -> usize {
    picture.pixels().filter(|pixel| pixel.0 == colour).count()
}

/// Whether the outermost pixels are all white: nothing reaches the border, so nothing is cut off.
fn has_a_clear_border(picture: &RgbImage) -> bool {
    let (width, height) = picture.dimensions();
    let border =
        picture.enumerate_pixels().filter(|&(x, y, _)| x < 2 || y < 2 || x + 2 >= width || y + 2 >= height);
    border.into_iter().all(|(.., pixel)| *pixel == WHITE)
}

#[test]
fn unknown_pixels_are_grey_and_values_span_the_colours() {
    let mut map = Grid::filled(40, 400, 1.0);
    map.row_mut(0)[..100].fill(f32::NAN);
    map.row_mut(1)[..100].fill(3.0);
    let range = ValueRange { low: 1.0, high: 3.0 };
    let picture = MapPicture::new(&map, "test", "px", range).picture().unwrap();
    // Each map pixel is a square of 2 x 2. The ends of viridis, from its definition.
    let samples = 15 * 15;
    assert!((400..=400 + samples).contains(&count(&picture, UNKNOWN)), "{}", count(&picture, UNKNOWN));
    // The ends of the colour scale are a row of it each.
    let bar = 40;
    assert!((400..=400 + bar).contains(&count(&picture, [253, 231, 37])));
    let low = 2 * 2 * (40 * 400 - 200);
    assert!((low..=low + bar).contains(&count(&picture, [68, 1, 84])));
}

#[test]
fn a_scale_that_is_cut_has_triangles_in_the_colours_of_its_ends() {
    let mut map = Grid::filled(60, 60, 0.5);
    map.row_mut(0)[0] = 2.0;
    let ends = |range: ValueRange| {
        let picture = MapPicture::new(&map, "t", "mm", range).picture().unwrap();
        // Pixels of the map have the colour of the middle, except for one square of 7 x 7 px.
        [count(&picture, [68, 1, 84]), count(&picture, [253, 231, 37])]
    };
    let [low, high] = ends(ValueRange { low: 0.0, high: 2.0 });
    let [same_low, cut_high] = ends(ValueRange { low: 0.0, high: 1.0 });
    assert_eq!(low, same_low);
    // A triangle of 20 x 12 px, less its border.
    assert!(cut_high > high + 60, "{high} {cut_high}");
    let [cut_low, _] = ends(ValueRange { low: 0.6, high: 2.0 });
    assert!(cut_low > 60 * 60 * 40, "{cut_low}");
}

#[test]
fn nothing_is_cut_off_whatever_the_shape() {
    let sizes = [(32, 32), (1, 1), (20, 900), (900, 20), (300, 1500), (1500, 40)];
    for (rows, columns) in sizes {
        let values = (0..rows * columns).map(|index| (index % columns) as f32 * 0.01 - 3.0).collect();
        let map = Grid::from_values(rows, columns, values).unwrap();
        let photograph = map.map(|value| 100.0 * value);
        for empty in [false, true] {
            let shown = if empty { map.map(|_| f32::NAN) } else { map.clone() };
            let range = ValueRange::of(&shown, 0.01);
            let title = "Standard uncertainty of the height after removal of the form";
            let plain = MapPicture::new(&shown, title, "mm", range);
            let full = plain
                .clone()
                .as_relief()
                .in_mm(Some(Millimetres { pixel_mm: 0.3164, origin_px: (16.0, 16.0) }))
                .beside(Some(&photograph));
            for picture in [plain, full] {
                let drawn = picture.picture().unwrap();
                assert!(has_a_clear_border(&drawn), "{rows} x {columns}, empty: {empty}");
                assert!(
                    drawn.width() <= 2 * 1200 + 300 && drawn.height() <= 1500,
                    "{:?}",
                    drawn.dimensions()
                );
            }
        }
    }
}

#[test]
fn the_photograph_shows_the_same_place_from_black_to_white() {
    let mut map = Grid::filled(200, 300, f32::NAN);
    (50..150).for_each(|y| map.row_mut(y)[100..200].fill(1.0));
    // Dark in the left half of the object, bright in its right half, and glaring far away from it.
    let values = (0..60_000).map(|index| match index % 300 {
        x if x < 150 => 20.0,
        x if x < 250 => 40.0,
        _ => 4000.0,
    });
    let photograph = Grid::from_values(200, 300, values.collect()).unwrap();
    let range = ValueRange { low: 0.0, high: 2.0 };
    let alone = MapPicture::new(&map, "t", "mm", range);
    let picture = alone.clone().beside(Some(&photograph)).picture().unwrap();
    // A window of 108 px in squares of 4: both halves of the photograph, 54 columns each.
    let half = 54 * 108 * 16;
    assert!(count(&picture, [0, 0, 0]) >= half && count(&picture, [255, 255, 255]) >= half);
    assert!(picture.width() > alone.picture().unwrap().width() + 108 * 4);
    // A photograph of another size shows another place.
    let other = Grid::filled(10, 10, 0.0);
    assert_eq!(alone.clone().beside(Some(&other)).picture().unwrap(), alone.picture().unwrap());
}

#[test]
fn a_relief_darkens_the_far_side_of_a_step_only_where_it_is_asked_for() {
    // A step down to the right: its wall faces away from the light.
    let values = (0..3600).map(|index| if index % 60 < 30 { 1.0 } else { 0.0 }).collect();
    let map = Grid::from_values(60, 60, values).unwrap();
    let range = ValueRange { low: 0.0, high: 1.0 };
    let plain = MapPicture::new(&map, "t", "mm", range);
    let colours = |picture: &MapPicture<'_>| {
        let drawn = picture.picture().unwrap();
        [count(&drawn, [253, 231, 37]), count(&drawn, [68, 1, 84])]
    };
    let (flat, lit) = (colours(&plain), colours(&plain.clone().as_relief()));
    // Two columns of squares of 7 x 7 px on each side of the step.
    let wall = 2 * 60 * 49;
    assert_eq!([flat[0] - lit[0], flat[1] - lit[1]], [wall, wall]);
}

#[test]
fn diverging_colours_are_blue_below_and_red_above_the_middle() {
    let values = (0..3600).map(|index| if index % 60 < 30 { -1.0 } else { 1.0 }).collect();
    let map = Grid::from_values(60, 60, values).unwrap();
    let range = ValueRange { low: -1.0, high: 1.0 };
    let picture = MapPicture::new(&map, "t", "mm", range).diverging().picture().unwrap();
    let half = 1800 * 49;
    let counted = |is: fn([u8; 3]) -> bool| picture.pixels().filter(|pixel| is(pixel.0)).count();
    assert!(counted(|[red, _, blue]| blue > red + 50) >= half);
    assert!(counted(|[red, _, blue]| red > blue + 50) >= half);
}
