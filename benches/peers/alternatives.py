"""The alternatives that the paper names, as it cites them: each gives the disparity of pixels of the first frame, NaN: none.

Those without a library are written here: two frames in windows (dynamic programming [3], confidently stable matching [9]) and a few
frames without order (verification [8]). Tracks of features are in tracks.py. What the literature leaves open was set to the value
that serves the method best on the scenes of scenes.py; the comments say so with "tuned".
"""

import numba
import numpy as np

RADIUS = 2
"""Windows are 5 x 5 px, as those of reference.py."""
STEP_PX = 0.25
"""Between disparity candidates of the two methods that search below a pixel, as epirig's."""
OUTSIDE = 1e6
"""The cost of a candidate that leaves the image."""
FAST = {"reassoc", "contract", "arcp", "nsz"}


@numba.njit(inline="always")
def cubic(row, x):
    """Value and slope of a row at x (Keys 1981, a = -1/2), which lies at least a pixel from either end."""
    whole = int(np.floor(x))
    f = x - whole
    a, b, c, d = row[whole - 1], row[whole], row[whole + 1], row[whole + 2]
    one, two, three = 0.5 * (c - a), a - 2.5 * b + 2 * c - 0.5 * d, 1.5 * (b - c) + 0.5 * (d - a)
    return b + f * (one + f * (two + f * three)), one + f * (2 * two + f * 3 * three)


@numba.njit
def box(image):
    """Means over windows, those at the borders over what lies in the image."""
    rows, columns = image.shape
    across = np.empty((rows, columns))
    means = np.empty((rows, columns))
    for y in range(rows):
        for x in range(columns):
            begin, end = max(x - RADIUS, 0), min(x + RADIUS + 1, columns)
            across[y, x] = image[y, begin:end].sum() / (end - begin)
    for y in range(rows):
        begin, end = max(y - RADIUS, 0), min(y + RADIUS + 1, rows)
        means[y] = 0
        for v in range(begin, end):
            means[y] += across[v] / (end - begin)
    return means


@numba.njit(parallel=True)
def pair_costs(first, last, least, count):
    """Mean squared difference between windows of two frames, candidates x rows x columns; `OUTSIDE` where one leaves the image."""
    rows, columns = first.shape
    costs = np.empty((count, rows, columns), np.float32)
    for k in numba.prange(count):
        square = np.empty((rows, columns))
        for y in range(rows):
            for x in range(columns):
                place = x + least + k * STEP_PX
                # Outside, the nearest column stands in, so that windows at the border have their inner part.
                value, _ = cubic(last[y], min(max(place, 1.0), columns - 2.001))
                square[y, x] = (value - first[y, x]) ** 2
        costs[k] = box(square)
        for x in range(columns):
            if not 0 <= x + least + k * STEP_PX <= columns - 1:
                costs[k, :, x] = OUTSIDE
    return costs


@numba.njit(fastmath=FAST, error_model="numpy")
def equations(volume, taus, y, x, unknown, matrix, vector):
    """Least squares' equations of one window at the disparity and slants `unknown`; the sum of squares and its degrees of freedom."""
    rows, frames, columns = volume.shape
    values, slopes = np.empty(frames), np.empty(frames)
    matrix[:] = 0
    vector[:] = 0
    squares, freedom = 0.0, 0
    for v in range(max(y - RADIUS, 0), min(y + RADIUS + 1, rows)):
        for u in range(max(x - RADIUS, 0), min(x + RADIUS + 1, columns)):
            place = (1.0, float(u - x), float(v - y))
            d = unknown[0] + unknown[1] * place[1] + unknown[2] * place[2]
            n, i, g = 0, 0.0, 0.0
            for t in range(frames):
                at = u + taus[t] * d
                if 1 <= at < columns - 2:
                    value, slope = cubic(volume[v, t], at)
                    values[n], slopes[n] = value, slope * taus[t]
                    i += values[n]
                    g += slopes[n]
                    n += 1
            if n < 2:
                continue
            freedom += n - 1
            gg = ig = 0.0
            for t in range(n):
                value, slope = values[t] - i / n, slopes[t] - g / n
                gg += slope * slope
                ig += slope * value
                squares += value * value
            for a in range(3):
                vector[a] -= ig * place[a]
                for b in range(3):
                    matrix[a, b] += gg * place[a] * place[b]
    return squares, freedom


@numba.njit(fastmath=FAST, error_model="numpy")
def fit(volume, taus, y, x, guess):
    """Disparity of one pixel and the variance about the fit, in at most eight Gauss-Newton steps."""
    matrix, vector, unknown = np.empty((3, 3)), np.empty(3), np.zeros(3)
    unknown[0] = guess
    variance = np.inf
    for _ in range(8):
        squares, freedom = equations(volume, taus, y, x, unknown, matrix, vector)
        if freedom < 9 or np.linalg.det(matrix) <= 1e-9 * matrix[0, 0] * matrix[1, 1] * matrix[2, 2]:
            return np.nan, np.inf
        variance = squares / freedom
        step = np.linalg.solve(matrix, vector)
        unknown += step
        if not abs(unknown[0] - guess) < 1:
            return np.nan, np.inf
        if abs(step[0]) < 1e-3:
            break
    return unknown[0], variance


@numba.njit(parallel=True)
def refine(volume, taus, guesses):
    """Least squares for disparity and its two slants in each window, over the frames at `taus`.

    `volume` is rows x frames x columns. Also gives the variance about the fit, in DN^2. NaN where the fit leaves its guess by a pixel.
    """
    rows, _, columns = volume.shape
    fitted = np.full((rows, columns), np.nan)
    residual = np.full((rows, columns), np.inf)
    for y in numba.prange(rows):
        for x in range(columns):
            if not np.isnan(guesses[y, x]):
                fitted[y, x], residual[y, x] = fit(volume, taus, y, x, guesses[y, x])
    return fitted, residual


def pair_volume(first, last):
    """Two frames as `refine` takes them."""
    return np.ascontiguousarray(np.stack([first, last], axis=1), np.float32)


SMOOTHNESS = 5.0
"""Price of a pixel of change of the disparity from one column to the next, in DN^2. Tuned."""
DEAREST = 100.0
"""Largest price of a difference, in DN^2: some five times the noise. Tuned."""
OUT_OF_SIGHT = 2.0
"""Price of a pixel whose match lies outside the last frame, in DN^2: what noise makes of a right match, so that neither is favoured."""


@numba.njit(parallel=True)
def cheapest_paths(costs):
    """Candidate of every pixel on the cheapest path of its row: a strictly increasing mapping, so j rises by a step at least."""
    count, rows, columns = costs.shape
    chosen = np.empty((rows, columns), np.int32)
    descent = int(round(1 / STEP_PX)) - 1
    for y in numba.prange(rows):
        total = np.empty(count)
        for k in range(count):
            cost = costs[k, y, 0]
            total[k] = OUT_OF_SIGHT if cost == OUTSIDE else min(cost, DEAREST)
        came = np.empty((columns, count), np.int32)
        for x in range(1, columns):
            # The running minimum of total + price of the climb, from below; then the few descents that keep the order.
            best, source = np.inf, 0
            prices = np.empty(count)
            for k in range(count):
                best += SMOOTHNESS * STEP_PX
                if total[k] <= best:
                    best, source = total[k], k
                prices[k], came[x, k] = best, source
                for down in range(1, min(descent, count - 1 - k) + 1):
                    price = total[k + down] + SMOOTHNESS * STEP_PX * down
                    if price < prices[k]:
                        prices[k], came[x, k] = price, k + down
            for k in range(count):
                cost = costs[k, y, x]
                total[k] = prices[k] + (OUT_OF_SIGHT if cost == OUTSIDE else min(cost, DEAREST))
        k = np.argmin(total)
        for x in range(columns - 1, -1, -1):
            chosen[y, x] = k
            if x > 0:
                k = came[x, k]
    return chosen


def dynamic_programming(frames, range_px):
    """[3] Binocular dynamic programming, row by row, on the end frames: no occlusion, order kept. Then least squares in windows."""
    first, last = frames[0].astype(np.float32), frames[-1].astype(np.float32)
    least, largest = range_px
    costs = pair_costs(first, last, least, int(round((largest - least) / STEP_PX)) + 1)
    chosen = cheapest_paths(costs)
    guesses = least + STEP_PX * chosen
    fitted, _ = refine(pair_volume(first, last), np.array([0.0, 1.0]), guesses)
    answer = np.where(np.isnan(fitted), guesses, fitted)
    answer[np.take_along_axis(costs, chosen[None].astype(int), 0)[0] == OUTSIDE] = np.nan
    return answer


MARGIN = 0.1
"""By how much a correlation must exceed those of its competitors: larger, and fewer answers, of which fewer are wrong. Tuned."""
LEAST_CORRELATION = 0.7
"""Of a match: chance reaches less. Tuned."""


@numba.njit(parallel=True)
def correlations(first, last, least, count):
    """Moravec's normalised correlation 2 cov / (var + var) of windows at whole-pixel candidates: rows x columns x candidates."""
    rows, columns = first.shape
    table = np.full((rows, columns, count), -np.inf)
    m1, m2 = box(first), box(last)
    v1, v2 = box(first * first) - m1 * m1, box(last * last) - m2 * m2
    for k in numba.prange(count):
        d = least + k
        begin, end = max(0, -d), min(columns, columns - d)
        if begin >= end:
            continue
        products = box(first[:, begin:end] * last[:, begin + d : end + d])
        for y in range(rows):
            for x in range(begin, end):
                cov = products[y, x - begin] - m1[y, x] * m2[y, x + d]
                table[y, x, k] = 2 * cov / (v1[y, x] + v2[y, x + d] + 1e-9)
    return table


@numba.njit(parallel=True)
def stable_matches(table, least):
    """The largest confidently stable matching of every row, without ordering; candidate of every pixel, -1: none.

    A pair is taken if it beats, by the margin, all pairs left that share one of its pixels. Its competitors are then out, which may
    let others win. The result does not depend on the sequence. Neighbours by one pixel in disparity are the same match before it is
    refined, so that a pair need only be as good as those.
    """
    rows, columns, count = table.shape
    chosen = np.full((rows, columns), -1, np.int32)
    for y in numba.prange(rows):
        left = table[y].copy()
        again = True
        while again:
            again = False
            for i in range(columns):
                k = np.argmax(left[i])
                own = left[i, k]
                if own < LEAST_CORRELATION:
                    continue
                j = i + least + k
                wins = True
                for other in range(count):
                    near = abs(other - k) <= 1
                    if other != k and left[i, other] > own - (0 if near else MARGIN):
                        wins = False
                    at = j - least - other
                    if other != k and 0 <= at < columns and left[at, other] > own - (0 if near else MARGIN):
                        wins = False
                if wins:
                    chosen[y, i] = k
                    for other in range(count):
                        left[i, other] = -np.inf
                        at = j - least - other
                        if 0 <= at < columns:
                            left[at, other] = -np.inf
                    again = True
    return chosen


def stable_matching(frames, range_px):
    """[9] Confidently stable matching (Sara 2002) of the end frames, then least squares in windows for the fraction of a pixel."""
    first, last = frames[0].astype(np.float64), frames[-1].astype(np.float64)
    least, largest = (int(value) for value in range_px)
    chosen = stable_matches(correlations(first, last, least, largest - least + 1), least)
    guesses = np.where(chosen < 0, np.nan, least + chosen)
    return refine(pair_volume(first, last), np.array([0.0, 1.0]), guesses)[0]


IMAGES = 8
"""How many of the frames are used: unorganised sets are small."""
CANDIDATES = 8
"""Of two frames, for the others to decide between: more than the periods of a texture in any range here."""
CONSISTENT = 2.0
"""Largest variance about the fit, in DN^2: that of noise and rounding is 1.08."""


@numba.njit(parallel=True)
def verified(costs, volume, taus, least):
    """Of each pixel's least local minima over the candidates of two frames, the one with least variance in windows of all images."""
    count, rows, columns = costs.shape
    _, images, _ = volume.shape
    guesses = np.full((rows, columns), np.nan)
    for y in numba.prange(rows):
        values = np.empty(images)
        for x in range(columns):
            minima = np.full(count, np.inf)
            for k in range(1, count - 1):
                here = costs[k, y, x]
                if here < OUTSIDE and here <= costs[k - 1, y, x] and here <= costs[k + 1, y, x]:
                    minima[k] = here
            least_variance = np.inf
            for k in np.argsort(minima)[:CANDIDATES]:
                if minima[k] == np.inf:
                    break
                before, here, after = costs[k - 1, y, x], costs[k, y, x], costs[k + 1, y, x]
                curve = before - 2 * here + after
                vertex = 0.5 * (before - after) / curve if 0 < curve and max(before, after) < OUTSIDE else 0.0
                d = least + (k + vertex) * STEP_PX
                squares, freedom = 0.0, 0
                for v in range(max(y - RADIUS, 0), min(y + RADIUS + 1, rows)):
                    for u in range(max(x - RADIUS, 0), min(x + RADIUS + 1, columns)):
                        n = 0
                        for t in range(images):
                            at = u + taus[t] * d
                            if 1 <= at < columns - 2:
                                values[n], _ = cubic(volume[v, t], at)
                                n += 1
                        if n > 1:
                            squares += ((values[:n] - values[:n].mean()) ** 2).sum()
                            freedom += n - 1
                if freedom > 9 and squares / freedom < least_variance:
                    least_variance = squares / freedom
                    guesses[y, x] = d
    return guesses


def verification(frames, range_px):
    """[8] A pair's candidates, verified by the variance of the intensities in eight unorganised images, and refined over these.

    The images are drawn at random, with the first and the last among them; where they were taken from is known, as it must be.
    """
    inner = np.random.default_rng(1).choice(np.arange(1, len(frames) - 1), IMAGES - 2, replace=False)
    indices = np.array([0, *inner, len(frames) - 1])
    volume = np.ascontiguousarray(frames[indices].transpose(1, 0, 2), np.float32)
    taus = indices / (len(frames) - 1)
    least, largest = range_px
    costs = pair_costs(volume[:, 0].copy(), volume[:, -1].copy(), least, int(round((largest - least) / STEP_PX)) + 1)
    fitted, residual = refine(volume, taus, verified(costs, volume, taus, least))
    return np.where(residual < CONSISTENT, fitted, np.nan)
