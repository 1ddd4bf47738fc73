"""Two alternatives of the paper that detect features and follow them through all frames: sparse, in disparity and in place.

Each gives two maps, NaN: none. The first is the disparity of a feature, at the pixel of the first frame that it lies in; the second is
where along x it lies there, in px.
"""

import cv2
import numba
import numpy as np

WINDOW_PX = 9
"""Side of Lucas-Kanade's window. Tuned; OpenCV's default is 21."""
LEVELS = 2
"""Levels of the pyramid above the frames: displacements between frames are below a pixel, so that it is hardly needed."""
TERMINATION = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 0.001)
"""OpenCV's default is 0.01 px, which would be an error of that size in each frame."""
FROM_ROW_PX = 0.5
"""A track that leaves its row by more is wrong, for the frames are rectified."""


def lucas_kanade(frames, range_px, to_first):
    """[10] Corners (Shi and Tomasi), followed through all frames by the pyramidal Lucas-Kanade tracker of OpenCV.

    From frame to frame, as trackers do; or with `to_first`, each frame compared with the first, from where the previous one left off.
    Then errors do not add up, and a line through all positions is the best estimate. Corners as in OpenCV's examples, but with a
    distance of 3 px and a quality of 0.01, so that there are many.
    """
    rows, columns = frames[0].shape
    corners = cv2.goodFeaturesToTrack(frames[0], 0, 0.01, 3, blockSize=5)
    options = {"winSize": (WINDOW_PX, WINDOW_PX), "maxLevel": LEVELS, "criteria": TERMINATION}
    points = corners.copy()
    good = np.ones(len(corners), bool)
    taus = np.linspace(0, 1, len(frames))
    moments = np.zeros(len(corners))
    for t in range(1, len(frames)):
        if to_first:
            points, status, _ = cv2.calcOpticalFlowPyrLK(
                frames[0], frames[t], corners, points.copy(), flags=cv2.OPTFLOW_USE_INITIAL_FLOW, **options
            )
        else:
            points, status, _ = cv2.calcOpticalFlowPyrLK(frames[t - 1], frames[t], points, None, **options)
        good &= status[:, 0] == 1
        good &= np.abs(points[:, 0, 1] - corners[:, 0, 1]) < FROM_ROW_PX
        moments += taus[t] * (points[:, 0, 0] - corners[:, 0, 0])
    moved = points[:, 0, 0] - corners[:, 0, 0]
    disparity = moments / np.sum(taus**2) if to_first else moved
    good &= (disparity > range_px[0]) & (disparity < range_px[1])
    # Back from the last frame: a track that does not return was lost on the way (Kalal's forward-backward error).
    if to_first:
        back, status, _ = cv2.calcOpticalFlowPyrLK(
            frames[-1], frames[0], points, corners.copy(), flags=cv2.OPTFLOW_USE_INITIAL_FLOW, **options
        )
    else:
        back = points
        for t in range(len(frames) - 1, 0, -1):
            back, status, _ = cv2.calcOpticalFlowPyrLK(frames[t], frames[t - 1], back, None, **options)
            good &= status[:, 0] == 1
    good &= (status[:, 0] == 1) & (np.abs(back - corners).max(axis=(1, 2)) < 0.5)
    answer, place = np.full((2, rows, columns), np.nan)
    x, y = corners[good, 0, 0], corners[good, 0, 1]
    at = np.rint(y).astype(int), np.rint(x).astype(int)
    answer[at], place[at] = disparity[good], x
    return answer, place


SMOOTHING_PX = 0.7
"""Of the Gaussian before zero crossings are sought. Tuned; Bolles, Baker and Marimont take some pixels, on larger structures."""
STEEPEST_DN = 1.0
"""Least slope at a zero crossing, in DN/px: some three times its noise after smoothing."""
GATE_PX = 0.4
"""How far from its prediction a feature may lie in the next frame. Tuned."""
GAPS = 2
"""How many frames in a row may lack the feature."""
LEAST_SHARE = 0.5
"""Share of the frames that a line must have, as of epirig's pixels."""
LARGEST_RMS_PX = 0.1
"""Of the features about their line. Tuned."""


@numba.njit
def zero_crossings(curvature, slope, places, signs):
    """Where along a row the second derivative changes sign and the slope is steep; how many."""
    n = 0
    for x in range(len(curvature) - 1):
        a, b = curvature[x], curvature[x + 1]
        if (a < 0) != (b < 0):
            f = a / (a - b)
            steep = slope[x] + f * (slope[x + 1] - slope[x])
            # The slope is extreme here. It is steepest where its size falls to both sides.
            if abs(steep) > STEEPEST_DN and (steep > 0) == (a > 0):
                places[n] = x + f
                signs[n] = 1 if steep > 0 else -1
                n += 1
    return n


@numba.njit(parallel=True)
def epi_lines(slopes, curvatures, least, largest):
    """Lines of zero crossings in every epipolar plane image (rows x frames x columns): disparity and place, as maps."""
    rows, frames, columns = slopes.shape
    answer = np.full((rows, columns), np.nan)
    place = np.full((rows, columns), np.nan)
    for y in numba.prange(rows):
        places, signs = np.empty((frames, columns)), np.empty((frames, columns), np.int8)
        counts = np.empty(frames, np.int32)
        for t in range(frames):
            counts[t] = zero_crossings(curvatures[y, t], slopes[y, t], places[t], signs[t])
        for f in range(counts[0]):
            # Least squares of the line x = x0 + d tau, over what was linked so far; the first link must lie in the range.
            n, st, sx, stt, stx, sxx = 1, 0.0, 0.0, 0.0, 0.0, 0.0
            start = places[0, f]
            missed, t = 0, 1
            while t < frames and missed <= GAPS:
                tau = t / (frames - 1)
                spread = n * stt - st * st
                if n >= 4:
                    d = (n * stx - st * sx) / spread
                    low = high = start + (sx - d * st) / n + d * tau
                elif n >= 2:
                    d = min(max((n * stx - st * sx) / spread, least), largest)
                    low = high = start + (sx - d * st) / n + d * tau
                else:
                    low, high = start + least * tau, start + largest * tau
                centre, reach = 0.5 * (low + high), 0.5 * (high - low) + GATE_PX
                best = -1
                for g in range(counts[t]):
                    distance = abs(places[t, g] - centre)
                    if signs[t, g] == signs[0, f] and distance <= reach:
                        best, reach = g, distance
                if best < 0:
                    missed += 1
                else:
                    missed = 0
                    x = places[t, best] - start
                    n += 1
                    st += tau
                    sx += x
                    stt += tau * tau
                    stx += tau * x
                    sxx += x * x
                t += 1
            if n < LEAST_SHARE * frames:
                continue
            spread = n * stt - st * st
            d = (n * stx - st * sx) / spread
            at_start = (sx - d * st) / n
            rms = np.sqrt(max(sxx - at_start * sx - d * stx, 0.0) / (n - 2))
            x = int(np.rint(start + at_start))
            if least < d < largest and rms < LARGEST_RMS_PX and 0 <= x < columns:
                answer[y, x] = d
                place[y, x] = start + at_start
    return answer, place


def bolles(frames, range_px):
    """[1] Lines of features in epipolar plane images: zero crossings of the smoothed frames, linked, and a straight line through each."""
    slopes, curvatures = np.empty((2, frames.shape[1], len(frames), frames.shape[2]), np.float32)
    for t, frame in enumerate(frames):
        smooth = cv2.GaussianBlur(frame.astype(np.float32), (0, 0), SMOOTHING_PX)
        slopes[:, t] = cv2.filter2D(smooth, -1, np.array([[-0.5, 0, 0.5]]))
        curvatures[:, t] = cv2.filter2D(smooth, -1, np.array([[1.0, -2, 1]]))
    return epi_lines(slopes, curvatures, *range_px)
