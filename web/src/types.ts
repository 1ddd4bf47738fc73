// What the program tells the page and is sent by it. Written by `EPIRIG_WRITE_TABLES=1 cargo test --lib page_type_tests`.

/**
 * The program, and what it shows.
 */
export type About = { program: string, version: string, 
/**
 * `view` or `ui`.
 */
mode: 'view' | 'ui', 
/**
 * Whether there is a rig.
 */
rig: boolean, sequence: string | null, 
/**
 * Which results are there; another text after another match, or for another sequence.
 */
results: string | null, };

/**
 * Whether what a scan asked for is arranged; else it was cancelled.
 */
export type Arranged = { done: boolean, };

/**
 * What a person is asked to put before the camera.
 */
export type Asked = { 
/**
 * `object`, `dark`, `flat` or `board`.
 */
kind: 'object' | 'dark' | 'flat' | 'board', 
/**
 * An instruction.
 */
words: string, 
/**
 * Number of the pose, from 1.
 */
pose: number | null, 
/**
 * Number of poses.
 */
poses: number | null, 
/**
 * Whether the shot is taken by itself.
 */
by_itself: boolean, 
/**
 * Why it was not taken yet.
 */
waiting_for: string | null, };

export type Budget = { contributions: Array<Contribution>, combined: Combined | null, };

export type CalibrationFigure = { name: string, title: string, };

export type CalibrationInfo = { figures: Array<CalibrationFigure>, notes: Array<string>, needs: Array<string>, };

/**
 * The camera.
 */
export type CameraState = { 
/**
 * Whether it is there.
 */
state: Presence, 
/**
 * Model and place.
 */
name: string, 
/**
 * Why it is not there.
 */
error: string | null, 
/**
 * Whether it is simulated.
 */
simulated: boolean, 
/**
 * Rows of a frame.
 */
rows: number, 
/**
 * Columns of a frame.
 */
columns: number, 
/**
 * Bits of a sample.
 */
bit_depth: number, 
/**
 * Exposure, in us.
 */
exposure_us: number | null, 
/**
 * Frames per second of the camera.
 */
rate_hz: number | null, 
/**
 * Pictures that came in the last second.
 */
picture_hz: number | null, };

/**
 * One check.
 */
export type Check = { 
/**
 * What was checked, in a word or two.
 */
name: string, 
/**
 * The verdict.
 */
verdict: Verdict, 
/**
 * The finding, with numbers and units.
 */
finding: string, 
/**
 * What to do, if anything.
 */
advice: string | null, };

export type Combined = { sigma_mm: number, degrees_of_freedom: number, coverage_factor: number, half_width_95_mm: number, };

/**
 * How the differences are spread.
 */
export type CompareInfo = { rows: number, columns: number, step: number, unit: string, count: number, mean: number | null, median: number | null, standard_deviation: number | null, in_sigma: InSigma, 
/**
 * How another scan lay; `None` for other results of the same frames.
 */
scan: OtherScan | null, };

/**
 * What is to be compared.
 */
export type CompareQuery = { 
/**
 * Name of the other results.
 */
with: string, 
/**
 * Heights, if it begins so, else disparities.
 */
map: string | null, };

/**
 * What was measured, how well that is known, and whether it is as planned.
 */
export type Conclusion = { 
/**
 * All of it in words, in ASCII.
 */
sentence: string, 
/**
 * The depth alone with its 95 % interval, in ASCII; `None` if that is not known.
 */
depth: string | null, 
/**
 * The depth that the rig's profile plans (`target.relief`), in mm, if one is recorded.
 */
planned_mm: number | null, 
/**
 * Whether the 95 % interval of the depth holds it; `None` if nothing is planned or measured.
 */
as_planned: boolean | null, 
/**
 * The verdict about all limits; `None` without limits.
 */
verdict: 'pass' | 'fail' | 'undecided' | null, 
/**
 * The same in words, with the values that decide and their limits, in ASCII.
 */
verdict_sentence: string | null, };

export type Contribution = { name: string, evaluation: 'A' | 'B', sigma_mm: number | null, share: number | null, };

/**
 * A control of the camera.
 */
export type Control = { name: string, kind: 'integer' | 'boolean' | 'menu' | 'bitmask' | 'button' | 'other', minimum: number, maximum: number, step: number, default: number, value: number | null, read_only: boolean, inactive: boolean, items: Array<[number, string]>, };

/**
 * A control of the camera, and its new value.
 */
export type ControlValue = { name: string, value: string, };

/**
 * The controls of the camera.
 */
export type Controls = Array<Control>;

export type Depth = { depth_mm: number, sigma_mm: number | null, degrees_of_freedom: number | null, half_width_95_mm: number | null, scale_sigma_mm: number, };

/**
 * The latest examination.
 */
export type DoctorState = { 
/**
 * Local time, `hh:mm:ss`.
 */
at: string, 
/**
 * Whether checks that need many moves were left out.
 */
short: boolean, 
/**
 * The checks.
 */
checks: Array<Check>, 
/**
 * Predicted standard uncertainty of the height of a pixel, in mm.
 */
predicted_mm: number | null, };

export type Download = { name: string, title: string, bytes: number, };

export type EpiWindow = { first_column: number, low: number, high: number, };

/**
 * An examination of the rig.
 */
export type Examination = { 
/**
 * Leaves out what needs many moves.
 */
short: boolean, };

/**
 * Use of the heights, as in `used.png`.
 */
export type FieldSummary = { 
/**
 * Region of the picture, if one was given.
 */
region: unknown, 
/**
 * Mask of the picture, if one was given; pixels must lie in both.
 */
mask: MaskFacts | null, 
/**
 * Pixels of it that have a height, without those of the target.
 */
answered_px: number, 
/**
 * Pixels that have a height and were left out because they show the calibration's target.
 */
target_px: number, 
/**
 * Pixels of the largest connected region; all other numbers refer to it.
 */
used_px: number, 
/**
 * Pixels left out because their sigma is much larger than usual.
 */
uncertain_px: number, 
/**
 * Pixels left out because they are not connected to the region.
 */
apart_px: number, 
/**
 * Pixels left out at the rim of the region.
 */
rim_px: number, 
/**
 * Pixels left out because they lie far beyond the levels, with few others: outliers.
 */
outlier_px: number, };

/**
 * A file of the results, or a picture of the calibration.
 */
export type FileName = { name: string, };

/**
 * Whether a frame is as captured, or corrected and rectified.
 */
export type FrameKind = "raw" | "rectified";

/**
 * A tile of a frame.
 */
export type FrameTile = { t: number, kind: FrameKind | null, level: number, row: number, column: number, };

export type FramesInfo = { count: number, rows: number, columns: number, bit_depth: number, reference: number, kinds: Array<FrameKind>, matched: FrameKind, };

export type Geometry = { pixel_mm: number, distance_mm: number, 
/**
 * The place whose lateral coordinates are zero: where the optical axis meets the image.
 */
origin_px: [number, number], };

/**
 * Numbers of values in bars of equal width.
 */
export type Histogram = { low: number, high: number, counts: Array<number>, };

/**
 * Shares of the differences within one and two combined standard uncertainties.
 */
export type InSigma = { one: number, two: number, };

/**
 * The paper's figure 5a: DN in each frame along the line, and along the lines of the neighbours in disparity.
 */
export type Intensity = { along: Array<number | null>, left: Array<number | null>, right: Array<number | null>, };

/**
 * A button that moves the stage while it is held.
 */
export type JogButton = { id: number, 
/**
 * 1 for up, -1 for down.
 */
direction: number, fast: boolean, };

/**
 * The button that is held, or released.
 */
export type JogId = { id: number, };

/**
 * A position or a distance.
 */
export type Length = { mm: number, };

/**
 * What is known of a levelled map.
 */
export type LevelledInfo = { 
/**
 * Tilt that was taken away, in mrad; positive where the right or the lower side is nearer to the camera.
 */
tilt_x_mrad: number, tilt_y_mrad: number, 
/**
 * Pixels with a value.
 */
valid: number, 
/**
 * Their share.
 */
share_valid: number, 
/**
 * Range that is shown at first: from 0.5 % to 99.5 % of the values, widened to take in connected pixels
 * beyond it. Small hollows are the result and must not be cut off.
 */
low: number, high: number, 
/**
 * Whether it was widened.
 */
widened: boolean, 
/**
 * The range of all values.
 */
minimum: number, maximum: number, histogram: Histogram, };

/**
 * Which levelled map is asked for.
 */
export type LevelledQuery = { map: string, levelled_by: string, };

/**
 * The two levels of a surface.
 */
export type LevelsSummary = { 
/**
 * Depth of the lower level below the upper, with the interval by its scatter alone.
 */
depth: Depth, 
/**
 * All contributions to its uncertainty, and their sum.
 */
budget: Budget, 
/**
 * Whether each half of the frames was measured on the levels that the other half shows. Otherwise the heights
 * were divided by themselves, and the depth is too large.
 */
by_halves: boolean, 
/**
 * Whether parts rise from the lower level.
 */
raised: boolean, 
/**
 * Distance from the walls that was left out, in px.
 */
margin_px: number, 
/**
 * Depth at other distances. If it still grows, windows reach across the walls.
 */
by_margin: unknown, 
/**
 * Depth on the plateaus of ISO 5436-1, if parts are wide enough for them.
 */
on_plateaus: unknown, 
/**
 * Width of the walls from 10 % to 90 % of the depth, in mm, to about a pixel: that of the object's walls, of blur and
 * windows together.
 */
wall_width_mm: number | null, 
/**
 * Errors of pixels further apart than this are independent, in px.
 */
correlation_reach_px: number, 
/**
 * Roughness of the levels away from the walls, with the noise that sigma predicts.
 */
roughness: Roughness | null, 
/**
 * Roughness of the upper level alone, away from the walls.
 */
upper: Roughness | null, 
/**
 * Roughness of the lower level alone, away from the walls.
 */
lower: Roughness | null, 
/**
 * Each part.
 */
parts: Array<Part>, };

/**
 * Light and sharpness of a picture.
 */
export type LightState = { 
/**
 * Mean, in DN.
 */
mean_dn: number, 
/**
 * The darkest sample, in DN.
 */
minimum_dn: number, 
/**
 * The brightest sample, in DN.
 */
maximum_dn: number, 
/**
 * Full scale, in DN.
 */
full_scale_dn: number, 
/**
 * Pixels.
 */
pixels: number, 
/**
 * Pixels at full scale.
 */
saturated: number, 
/**
 * Pixels at 0.
 */
black: number, 
/**
 * Sharpness; see [`Assessment`](epirig_devices::camera::Assessment).
 */
focus: number, 
/**
 * Its largest value since it was reset.
 */
focus_peak: number, 
/**
 * Mean light of the four corners over that of the centre.
 */
corners: number | null, 
/**
 * Levels per bin.
 */
bin_width_dn: number, 
/**
 * Samples in each bin.
 */
histogram: Array<number>, };

/**
 * Both ends of a line and its width, in px; by what the heights are levelled, as in `LevelledQuery`.
 */
export type LineEnds = { x0: number, y0: number, x1: number, y1: number, width: number, levelled_by: string | null, };

/**
 * A profile.
 */
export type LineInfo = { unit: 'mm', points: Array<LinePoint>, };

export type LinePoint = { x_px: number, y_px: number, distance_mm: number, height_mm: number | null, sigma_mm: number | null, };

/**
 * What stands before the values of a live map.
 */
export type LiveMapHead = { rows: number, columns: number, bin: number, frames: number, planned: number, unit: string, low: number, high: number, };

/**
 * Which live map is asked for.
 */
export type LiveMapQuery = { 
/**
 * `disparity`, which is the usual one, or `sigma`.
 */
kind: string | null, };

/**
 * The latest live map.
 */
export type LiveMapState = { 
/**
 * Counts the maps.
 */
number: number, 
/**
 * Frames that it was made of.
 */
frames: number, 
/**
 * Median sigma, in px.
 */
sigma_px: number, 
/**
 * The same as a height, in mm.
 */
sigma_mm: number | null, };

/**
 * The kind of a line of the log.
 */
export type LogKind = "note" | "warning" | "error";

/**
 * A line of the log.
 */
export type LogLine = { 
/**
 * Number of the line.
 */
number: number, 
/**
 * Local time, `hh:mm:ss`.
 */
at: string, 
/**
 * Its kind.
 */
kind: LogKind, 
/**
 * The line.
 */
words: string, };

/**
 * A class of pixels as the page is told of it.
 */
export type MapClass = { name: string, 
/**
 * Its share of all pixels.
 */
share: number, };

/**
 * A map as the page is told of it.
 */
export type MapInfo = { id: string, title: string, unit: string, rows: number, columns: number, levels: number, colours: 'viridis' | 'magma' | 'vik' | 'mask', scale: 'linear' | 'log', 
/**
 * What the values 0, 1, ... stand for; empty for quantities.
 */
classes: Array<MapClass>, 
/**
 * Pixels with a value.
 */
valid: number, 
/**
 * Their share.
 */
share_valid: number, 
/**
 * Range that is shown at first: from 0.5 % to 99.5 % of the values, widened to take in connected pixels
 * beyond it. Small hollows are the result and must not be cut off.
 */
low: number, high: number, 
/**
 * Whether it was widened.
 */
widened: boolean, 
/**
 * The range of all values.
 */
minimum: number, maximum: number, histogram: Histogram, };

/**
 * A tile of a map.
 */
export type MapTile = { id: string, level: number, row: number, column: number, 
/**
 * By what the map is levelled, as in `LevelledQuery`.
 */
levelled_by: string | null, };

/**
 * Which mask was used, for the records.
 */
export type MaskFacts = { 
/**
 * Name of the file, without its folder.
 */
file: string, 
/**
 * BLAKE3 of the file.
 */
blake3: string, 
/**
 * Pixels inside.
 */
inside_px: number, };

/**
 * A picture whose white pixels are inside, as a file.
 */
export type MaskFile = { name: string, 
/**
 * The bytes of the file.
 */
base64: string, };

export type MatchInfo = { name: string, calibrated: boolean, quick: boolean, tau: Array<number>, 
/**
 * Version of the format: that of [`ResultsKind::Match`].
 */
format: number, 
/**
 * Version of the program.
 */
program: string, 
/**
 * Uid of the sequence.
 */
sequence_uid: string, 
/**
 * How the scan ended: `complete`, `aborted`, `failed`, `not-closed` (its positions are wrong), or
 * `unfinished`.
 */
scan_ended: string, 
/**
 * Hash of the frames and their positions.
 */
frames_blake3: string, 
/**
 * Hash of the calibration that corrected and rectified the frames; `None` if they were matched as
 * captured.
 */
calibration: string | null, 
/**
 * Source of tau: `stage`, `import`, `equal-steps` (no positions are known), `target` or `texture`.
 */
positions: string, 
/**
 * Region of the picture that was asked for, if one was given.
 */
region: unknown, 
/**
 * Mask of the picture, if one was given; pixels were matched that lie in both.
 */
mask: MaskFacts | null, 
/**
 * The options of the matcher, as they were asked for.
 */
settings: unknown, 
/**
 * Index of the reference frame.
 */
reference: number, 
/**
 * Part of the baseline before the reference frame.
 */
tau_before: number, 
/**
 * Part of the baseline after it.
 */
tau_after: number, 
/**
 * Smallest disparity searched, in px.
 */
minimum_px: number, 
/**
 * Largest disparity searched, in px.
 */
maximum_px: number, 
/**
 * Whether the range was found from the data.
 */
range_found: boolean, 
/**
 * Whether the ordering constraint was applied.
 */
ordering_constraint: unknown, 
/**
 * Neighbouring pixels of the final map that change their order between the first and the last frame.
 * Without the ordering constraint depth edges do that. With it the mapping of candidates has no
 * violations, so they come from the fit.
 */
order_violations: number, 
/**
 * Share of the pixels that belong to the object: they have answers to all four sides.
 */
object: number, 
/**
 * Share of the object's pixels with an answer.
 */
object_answered: number, 
/**
 * Share of the pixels with an answer.
 */
answered: number, 
/**
 * Share of the pixels whose line is in view in too few frames.
 */
leaves_image: number, 
/**
 * Share of the pixels whose best candidate is at an end of the range.
 */
beyond_range: number, 
/**
 * Share of the pixels whose sigma exceeds the limit: too little texture, or no line fits.
 */
no_texture: number, 
/**
 * Share of the pixels with several equally good candidates.
 */
ambiguous: number, 
/**
 * Share of the pixels that are occluded in too many frames.
 */
occluded: number, 
/**
 * Share of the pixels outside region or mask, which were not asked for.
 */
outside: number, 
/**
 * Median disparity of the answered pixels, in px; `None` if there are none.
 */
median_disparity_px: number | null, 
/**
 * Median sigma of the answered pixels, in px.
 */
median_sigma_px: number | null, 
/**
 * Pixel locking; absent if it could not be measured.
 */
pixel_locking: unknown, 
/**
 * How the light changed, which is taken off; absent if nothing shows it.
 */
light: unknown, 
/**
 * Distance that is the zero of heights, in mm, if the geometry is known.
 */
distance_mm: number | null, 
/**
 * Duration of the matching, in s.
 */
seconds: number, };

/**
 * A change of the mean.
 */
export type MeanChange = { 
/**
 * Number of the first value after it, from 0.
 */
first: number, 
/**
 * Its earliest and latest place, with 95 % coverage.
 */
earliest: number, latest: number, before: number, after: number, };

/**
 * What stands before the heights.
 */
export type MeshInfo = { rows: number, columns: number, step: number, pixel_mm: number, low_mm: number, high_mm: number, distance_mm: number, };

/**
 * Heights in three dimensions, of so many points at most.
 */
export type MeshQuery = { most: number, 
/**
 * The map of heights.
 */
map: string, 
/**
 * By what they are levelled, as in `LevelledQuery`.
 */
levelled_by: string | null, };

/**
 * What a name may be: for the form of the page, which checks it while somebody types.
 */
export type NameRule = { 
/**
 * As a regular expression for the whole name.
 */
pattern: string, 
/**
 * In words.
 */
words: string, };

export type Neighbour = { column: number, row: number, disparity_px: number, agrees: boolean, };

/**
 * Nothing more.
 */
export type Nothing = Record<symbol, never>;

/**
 * A quantity that can be followed.
 */
export type Offered = { measure: 'depth' | 'bow' | 'wall-width' | 'noise' | 'answered' | 'distance' | 'brightness' | 'flicker' | 'mapping' | 'blur' | 'stage-error' | 'roll' | 'pan', 
/**
 * What it is, in a sentence.
 */
meaning: string, };

/**
 * The value of one pixel.
 */
export type OneValue = { 
/**
 * `None` if the pixel has none.
 */
value: number | null, 
/**
 * Its standard uncertainty, if there is a map of it.
 */
sigma: number | null, 
/**
 * Why a map has no value here.
 */
reason: string | null, };

/**
 * How the object lay in the other scan.
 */
export type OtherScan = { 
/**
 * How far the middle of its picture lies to the right and down.
 */
shift_px: [number, number], turn_deg: number, 
/**
 * Connected places where the difference exceeds three sigma.
 */
places: number, };

export type Part = { centre_x_px: number, centre_y_px: number, area_px: number, area_mm2: number, used_px: number, depth: Depth, };

/**
 * What is sent before the values.
 */
export type PictureHead = { number: number, x: number, y: number, bin: number, rows: number, columns: number, frame_rows: number, frame_columns: number, age_ms: number, };

/**
 * A picture, as the list of the sequences names it.
 */
export type PictureName = { picture: string, };

/**
 * What a page wishes to see.
 */
export type PictureWish = { 
/**
 * The part of the frame, in px; all of it by default.
 */
x: number, y: number, width: number, height: number, 
/**
 * Most values that are sent.
 */
pixels: number, 
/**
 * Every picture; else two in a second.
 */
live: boolean, };

/**
 * A pixel; its heights may be levelled, by what is told as in `LevelledQuery`.
 */
export type Pixel = { x: number, y: number, levelled_by: string | null, };

export type PixelCost = { disparity_px: Array<number>, cost: Array<number | null>, scale: string, chosen_px: number | null, };

/**
 * All about a pixel.
 */
export type PixelInfo = { rows: number, columns: number, x: number, y: number, x_mm: number | null, y_mm: number | null, answer: 'found' | 'leaves-image' | 'beyond-range' | 'no-texture' | 'occluded' | 'ambiguous' | 'outside', reason: string, values: Array<PixelValue>, better_than: number | null, epi: EpiWindow, tau: Array<number>, reference: number, line: PixelLine | null, neighbours: Array<Neighbour>, intensity: Intensity | null, cost: PixelCost | null, };

export type PixelLine = { column: number, disparity_px: number, sigma_px: number, };

export type PixelValue = { id: string, title: string, unit: string, value: number | null, sigma: number | null, };

export type Plan = { name: string, names: NameRule, folder: string, frames: number, start_mm: number, step_mm: number, end_mm: number, dark: number, flat: number, board: number, averaged: number, seconds: number | null, needs_bytes: number | null, free_bytes: number | null, };

/**
 * Whether a part of the rig is there.
 */
export type Presence = "connecting" | "live" | "ready" | "busy" | "lost";

/**
 * The profile in use, key by key.
 */
export type Profile = { source: string, file: string, sections: Array<ProfileSection>, controls: Array<[string, string]>, };

/**
 * A key of a draft.
 */
export type ProfileKey = { 
/**
 * With its section, such as `plan.step`.
 */
path: string, 
/**
 * Without its section.
 */
name: string, 
/**
 * What it is.
 */
meaning: string, 
/**
 * What a value must be, in words.
 */
allowed: string, 
/**
 * The value without the key, if there is one.
 */
default: string | null, 
/**
 * An allowed value.
 */
example: string, 
/**
 * The allowed values, if they can be listed.
 */
choices: Array<string> | null, 
/**
 * The value as it is written; `None` if the key is not set.
 */
value: string | null, 
/**
 * Whether the key has an effect with the chosen stage and camera.
 */
applies: boolean, };

/**
 * A mistake in a value.
 */
export type ProfileMistake = { key: string | null, words: string, };

/**
 * A section of a draft.
 */
export type ProfileSection = { 
/**
 * Its name in the file.
 */
name: string, 
/**
 * Its purpose.
 */
meaning: string, 
/**
 * All of its keys.
 */
keys: Array<ProfileKey>, };

/**
 * Values of the profile that are to be others, by their keys.
 */
export type ProfileValues = { values: { [key in string]: string }, };

/**
 * Mean height, tilt, and roughness about the least-squares plane. Uncertainties come from the scatter between
 * independent parts of the region; `None` if it has too few.
 */
export type RegionInfo = { 
/**
 * Pixels of the region; those of `roughness` are answered.
 */
pixels: number, mean_mm: number, mean_sigma_mm: number | null, 
/**
 * Positive where the right or the lower side is nearer to the camera.
 */
tilt_x_mrad: number, tilt_x_sigma_mrad: number | null, tilt_y_mrad: number, tilt_y_sigma_mrad: number | null, roughness: Roughness, };

/**
 * A region of a map of heights, in px: it ends before `x1` and `y1`.
 */
export type RegionQuery = { map: string, x0: number, y0: number, x1: number, y1: number, 
/**
 * By what the map is levelled, as in `LevelledQuery`.
 */
levelled_by: string | null, };

export type Results = { id: string, sequence: SequenceInfo, results: MatchInfo | null, others: Array<string>, geometry: Geometry | null, surface: SurfaceSummary | null, 
/**
 * What exists and is not shown, and why.
 */
unfit: string | null, 
/**
 * The part of the picture that has answers: x and y of its first pixel, and of the one after its last.
 */
answered_px: [number, number, number, number] | null, maps: Array<MapInfo>, frames: FramesInfo, };

/**
 * An attempt that failed.
 */
export type Retake = { 
/**
 * Index of the frame.
 */
index: number, 
/**
 * Number of the attempt, from 1.
 */
attempt: number, 
/**
 * Why.
 */
reason: string, };

/**
 * All that is known of the rig.
 */
export type RigState = { 
/**
 * What a person calls the rig: its file, or "the simulated rig".
 */
rig: string, 
/**
 * What it is doing.
 */
task: Task | null, 
/**
 * A stop was asked for, and the stage is not yet known to stand.
 */
stopping: boolean, 
/**
 * The camera.
 */
camera: CameraState, 
/**
 * Light and sharpness of the latest picture.
 */
light: LightState | null, 
/**
 * The chess-board in the latest picture, if one is looked for.
 */
target: TargetState | null, 
/**
 * The stage.
 */
stage: StageState, 
/**
 * The latest examination.
 */
doctor: DoctorState | null, 
/**
 * The latest scan.
 */
scan: ScanState | null, 
/**
 * The latest lines of the log, the newest last.
 */
log: Array<LogLine>, 
/**
 * The page that has control.
 */
controller: string | null, 
/**
 * Free space on the disk of the sequences, in bytes.
 */
free_bytes: number | null, };

export type Roughness = { sa_mm: number, sq_mm: number, sz_mm: number, ssk: number, sku: number, sq_noise_mm: number | null, sq_without_noise_mm: number | null, pixels: number, };

/**
 * A row of the maps.
 */
export type Row = { y: number, };

/**
 * The row that was asked for, and its costs' axes.
 */
export type RowCost = { rows: number, columns: number, y: number, first_px: number, step_px: number, mapping: Array<number | null>, };

/**
 * Where a profile was saved.
 */
export type Saved = { file: string, };

/**
 * The same, to be saved.
 */
export type SavedValues = { values: { [key in string]: string }, 
/**
 * Whether a file that is there is replaced.
 */
overwrite: boolean, };

/**
 * How a scan is going.
 */
export type ScanPhase = "running" | "pausing" | "paused" | "done" | "failed";

/**
 * A scan.
 */
export type ScanState = { 
/**
 * Name of the folder.
 */
name: string, 
/**
 * Its whole path.
 */
folder: string, 
/**
 * How it is going.
 */
state: ScanPhase, 
/**
 * Who holds it: `operator`, `camera`, `stage`, `disk`.
 */
held_by: Array<string>, 
/**
 * Why it was paused, or failed.
 */
reason: string | null, 
/**
 * Frames of the plan.
 */
planned: number, 
/**
 * Frames that are there.
 */
done: number, 
/**
 * Attempts that failed.
 */
retakes: Array<Retake>, 
/**
 * The frames of this run.
 */
stops: Array<Stop>, 
/**
 * What a person is asked to put before the camera.
 */
asked: Asked | null, 
/**
 * Time left, in s; negative if it is over.
 */
seconds_left: number | null, 
/**
 * Bytes still to be written, without compression.
 */
needs_bytes: number | null, 
/**
 * Free space on the disk, in bytes.
 */
free_bytes: number | null, 
/**
 * The latest live map.
 */
map: LiveMapState | null, 
/**
 * Frames and median sigma, in px, of the live maps: one for each number of frames, in their order.
 */
course: Array<[number, number]>, 
/**
 * Whether there are results.
 */
measured: boolean, };

/**
 * What is to be compared with the results on the page.
 */
export type ScansQuestion = { 
/**
 * Name of the other sequence in the list.
 */
sequence: string, };

export type SequenceEntry = { 
/**
 * Its folder, as seen from that of the panel.
 */
name: string, 
/**
 * When it was begun, as in RFC 3339; empty if that cannot be read.
 */
created: string, 
/**
 * How far the work has come.
 */
state: 'unreadable' | 'scan' | 'calibrated' | 'matched' | 'measured', ended: string, frames: number, planned: number, can_be_resumed: boolean, 
/**
 * Depth of the hollows, or height of the raised parts; `None` if it was not measured.
 */
depth_mm: number | null, 
/**
 * Half the width of its interval of 95 % coverage; `None` if that is not known.
 */
half_width_95_mm: number | null, 
/**
 * The verdict about the surface; `None` without limits.
 */
verdict: 'pass' | 'fail' | 'undecided' | null, 
/**
 * Why something is not told, or must not be trusted.
 */
problem: string | null, 
/**
 * Name of its picture: another one when the picture is another one. `None` if there is nothing to show.
 */
picture: string | null, };

export type SequenceInfo = { name: string, uid: string, created: string, frames: number, rows: number, columns: number, bit_depth: number, ended: string, end_in_words: string | null, origin: string, };

/**
 * A sequence in the folder of the panel.
 */
export type SequenceName = { name: string, };

/**
 * A control chart of single values.
 */
export type SeriesChart = { measure: 'depth' | 'bow' | 'wall-width' | 'noise' | 'answered' | 'distance' | 'brightness' | 'flicker' | 'mapping' | 'blur' | 'stage-error' | 'roll' | 'pan', 
/**
 * Its unit; empty for a share.
 */
unit: string, 
/**
 * The values, in the order in which the sequences were begun.
 */
points: Array<SeriesPoint>, mean: number, 
/**
 * Limits of control: three times the scatter beside the mean.
 */
lower: number, upper: number, 
/**
 * Standard deviation of a value, by the differences of neighbours.
 */
scatter: number, 
/**
 * Where the mean has changed; `None` if that may be chance.
 */
change: MeanChange | null, 
/**
 * Limits by which the newest surface was judged.
 */
lower_limit: number | null, upper_limit: number | null, };

export type SeriesPoint = { 
/**
 * Name of the sequence.
 */
sequence: string, 
/**
 * When it was begun, as in RFC 3339.
 */
begun: string, value: number, 
/**
 * Its standard uncertainty; `None` if that is not known.
 */
sigma: number | null, 
/**
 * The rules of a steady process that it breaks, in words.
 */
rules: Array<string>, };

/**
 * What of the sequences can be followed, and one of it.
 */
export type SeriesTrend = { 
/**
 * The quantities that two or more of the sequences have.
 */
offered: Array<Offered>, 
/**
 * The chart of the quantity that was asked for; `None` if it is not offered.
 */
chart: SeriesChart | null, 
/**
 * What could not be read, and of which sequence.
 */
problems: Array<string>, };

/**
 * What all orders say: which page they come from.
 */
export type Signature = { client: string, };

export type StageEvent = { at: string, words: string, };

export type StageFrame = { index: number, planned_mm: number | null, reported_mm: number | null, 
/**
 * Reported minus planned, in um.
 */
error_um: number | null, 
/**
 * Measured minus reported, in px of the median disparity, if a calibration has measured positions.
 */
measured_error_px: number | null, retakes: number, mean_dn: number, saturated: number, };

export type StageInfo = { frames: Array<StageFrame>, retakes: Array<StageRetake>, events: Array<StageEvent>, };

export type StageRetake = { frame: number, attempt: number, reason: string, at: string, };

/**
 * The stage.
 */
export type StageState = { 
/**
 * Whether it is there.
 */
state: Presence, 
/**
 * Model and port.
 */
name: string, 
/**
 * Why it is not there.
 */
error: string | null, 
/**
 * Whether it is simulated.
 */
simulated: boolean, 
/**
 * Position, in mm from home; `None` if unknown.
 */
position_mm: number | null, 
/**
 * Whether the position is known.
 */
homed: boolean, 
/**
 * Whether it moves.
 */
moving: boolean, 
/**
 * Whether a limit switch is closed.
 */
at_limit: boolean, 
/**
 * Length of the travel, in mm.
 */
travel_mm: number, 
/**
 * First and last position of the plan, in mm.
 */
plan_mm: [number, number] | null, 
/**
 * Sizes of steps for buttons, in mm.
 */
steps_mm: Array<number>, 
/**
 * How far a slow and a fast jog run on if this program dies, in mm.
 */
runs_on_mm: [number, number], };

/**
 * A frame of the scan.
 */
export type Stop = { 
/**
 * Its index.
 */
index: number, 
/**
 * Attempts that it took.
 */
attempts: number, 
/**
 * Planned position, in mm.
 */
planned_mm: number, 
/**
 * Reported position, in mm.
 */
reported_mm: number, 
/**
 * Share of saturated samples, 0 to 1.
 */
saturated: number, 
/**
 * Mean, in DN.
 */
mean_dn: number, 
/**
 * Time since the scan began, in s.
 */
at_s: number, };

/**
 * The part of the map that is asked about: a pixel must lie in both region and mask.
 */
export type SurfaceQuestion = { 
/**
 * Two corners, in px; `null` for the whole picture.
 */
region: [number, number, number, number] | null, 
/**
 * Only pixels inside of this, too; `null` for all.
 */
mask: MaskFile | null, trend: string, };

/**
 * Contents of `surface.json`.
 */
export type SurfaceSummary = { 
/**
 * Version of the record, that of [`ResultsKind::Surface`](super::ResultsKind).
 */
format: number, 
/**
 * Version of the program.
 */
program: string, 
/**
 * Uid of the sequence.
 */
sequence_uid: string, 
/**
 * Hash of the `match.json` of the results whose heights these are.
 */
matched_blake3: string, 
/**
 * The answer in words.
 */
conclusion: Conclusion, 
/**
 * Whether the surface conforms to its limits; `None` without limits.
 */
conformity: unknown, 
/**
 * How the scan had ended when it was matched, as in `match.json`.
 */
scan_ended: string, 
/**
 * Distance that is the zero of heights, in mm.
 */
distance_mm: number, 
/**
 * Width of a pixel at that distance, in mm.
 */
pixel_mm: number, 
/**
 * Column and row where x and y in mm are zero: those of the principal point.
 */
origin_px: [number, number], 
/**
 * Relative standard uncertainties of the scale. All lengths along the optical axis share both of them; those along
 * the picture share that of the baseline alone, because Z / f = b / |d|.
 */
scale_sigma: unknown, 
/**
 * The heights that were used.
 */
field: FieldSummary, 
/**
 * Form that was removed from the heights: that of the upper level if there are two, else of the whole
 * region.
 */
trend: unknown, 
/**
 * Its tilt along x and y, in deg.
 */
tilt_deg: [number, number], 
/**
 * Its bow over the region, in mm.
 */
bow_mm: number, 
/**
 * The two levels, if there are two.
 */
levels: LevelsSummary | null, 
/**
 * Why there are no levels.
 */
no_levels: string | null, 
/**
 * Filters of all roughness here.
 */
filters: unknown, 
/**
 * Roughness of the region after removal of the form and of outliers; hollows are included.
 */
roughness: Roughness, };

/**
 * Whether something is to be done from now on.
 */
export type Switched = { on: boolean, };

/**
 * Corners of a chess-board in the picture.
 */
export type TargetState = { 
/**
 * `board` for the one held by hand, `target` for those on the object.
 */
name: 'board' | 'target', 
/**
 * Corners of all boards.
 */
wanted: number, 
/**
 * x and y of the corners that were found, in px.
 */
corners: Array<[number, number]>, 
/**
 * Whether all were found.
 */
complete: boolean, 
/**
 * Blur of the edges, in px.
 */
blur_px: number | null, 
/**
 * Parts of the picture, each way.
 */
coverage_columns: number, 
/**
 * Parts of the picture, each way.
 */
coverage_rows: number, 
/**
 * Whether corners were seen in each part, row by row.
 */
coverage: Array<boolean>, };

/**
 * What the rig is doing.
 */
export type Task = { 
/**
 * Its kind.
 */
kind: TaskKind, 
/**
 * In words.
 */
words: string, 
/**
 * The step in hand.
 */
step: string | null, 
/**
 * Parts of the step that are done, and all of them.
 */
done: number | null, 
/**
 * All parts of the step.
 */
of: number | null, 
/**
 * Time left, in s.
 */
seconds_left: number | null, 
/**
 * A measurement ends at its next step: STOP was pressed.
 */
stops: boolean, };

/**
 * The kind of a task.
 */
export type TaskKind = "connecting" | "homing" | "moving" | "jogging" | "doctor" | "scan" | "measuring";

export type Trend = { name: string, title: string, };

/**
 * Which quantity is asked for, and of which sequences.
 */
export type TrendQuestion = { measure: 'depth' | 'bow' | 'wall-width' | 'noise' | 'answered' | 'distance' | 'brightness' | 'flicker' | 'mapping' | 'blur' | 'stage-error' | 'roll' | 'pan', 
/**
 * Names in the list of the sequences.
 */
sequences: Array<string>, };

/**
 * A pixel of a map, or of a frame.
 */
export type ValueQuery = { x: number, y: number, 
/**
 * The map; a frame if there is one.
 */
map: string, frame: number | null, kind: FrameKind | null, 
/**
 * By what a map of heights is levelled, as in `LevelledQuery`.
 */
levelled_by: string | null, };

/**
 * The verdict of a check.
 */
export type Verdict = "good" | "unknown" | "warning" | "bad";

/**
 * What a simulated camera is to see.
 */
export type View = { 
/**
 * `object`, `dark`, `flat` or `board`.
 */
what: string, 
/**
 * Number of the board's pose, from 0.
 */
pose: number, };
