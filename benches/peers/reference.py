"""The reference: what a good engineer writes in an afternoon with NumPy at hand and Numba to make it fast.

A cost volume (variance over all frames, linear interpolation, every half pixel, 5 x 5 box), the winner and a parabola; then
Gauss-Newton over all frames in a 5 x 5 window: disparity and its two slopes, cubic interpolation, the template eliminated.
Loops are laid out for the vectoriser (columns innermost, one shift for a whole row), rows run in parallel.
"""

import numba
import numpy as np

RASTER_PX = 0.5
RADIUS = 2
STEPS = 3


@numba.njit(fastmath=True, error_model="numpy")
def variance_row(volume, y, disparity, sums, squares, counts, cost):
    """Variance over the frames along every candidate of one row with one disparity; infinity if fewer than half of the frames see it."""
    _, frames, columns = volume.shape
    sums[:] = 0
    squares[:] = 0
    counts[:] = 0
    for t in range(frames):
        shift = disparity * t / (frames - 1)
        whole = int(np.floor(shift))
        f = np.float32(shift - whole)
        begin, end = max(0, -whole), min(columns, columns - 1 - whole)
        if begin >= end:
            continue
        left = volume[y, t, begin + whole : end + whole]
        right = volume[y, t, begin + whole + 1 : end + whole + 1]
        own = volume[y, 0, begin:end]
        s, q, n = sums[begin:end], squares[begin:end], counts[begin:end]
        for x in range(end - begin):
            value = left[x] + f * (right[x] - left[x]) - own[x]
            s[x] += value
            q[x] += value * value
            n[x] += 1
    for x in range(columns):
        n = counts[x]
        seen = 2 * n >= frames
        cost[x] = (squares[x] - sums[x] * sums[x] / max(n, 1)) / max(n - 1, 1) if seen else np.float32(np.inf)


@numba.njit(parallel=True, fastmath={"reassoc", "contract", "arcp", "nsz"}, error_model="numpy")
def search(volume, least, count, block):
    """Disparity of the least cost, to the parabola's vertex; NaN where the winner lies at an end of the range or beside candidates that leave the image."""
    rows, _, columns = volume.shape
    disparity = np.full((rows, columns), np.nan, np.float32)
    for b in numba.prange((rows + block - 1) // block):
        first, last = b * block, min(rows, (b + 1) * block)
        top, bottom = max(0, first - RADIUS), min(rows, last + RADIUS)
        sums, squares, counts = np.empty(columns, np.float32), np.empty(columns, np.float32), np.empty(columns, np.float32)
        cost = np.empty((bottom - top, columns), np.float32)
        line = np.empty(columns, np.float32)
        boxed = np.empty((last - first, count, columns), np.float32)
        for k in range(count):
            for y in range(top, bottom):
                variance_row(volume, y, least + k * RASTER_PX, sums, squares, counts, cost[y - top])
            for y in range(first, last):
                low, high = max(y - RADIUS, 0) - top, min(y + RADIUS + 1, rows) - top
                line[:] = 0
                for row in range(low, high):
                    for x in range(columns):
                        line[x] += cost[row, x]
                out = boxed[y - first, k]
                for x in range(columns):
                    out[x] = 0
                for dx in range(-RADIUS, RADIUS + 1):
                    for x in range(columns):
                        out[x] += line[min(max(x + dx, 0), columns - 1)]
        for y in range(first, last):
            table = boxed[y - first]
            best = np.full(columns, np.float32(np.inf))
            index = np.zeros(columns, np.int32)
            for k in range(count):
                for x in range(columns):
                    if table[k, x] < best[x]:
                        best[x] = table[k, x]
                        index[x] = k
            for x in range(columns):
                k = index[x]
                if 0 < k < count - 1 and table[k - 1, x] < np.inf and table[k + 1, x] < np.inf:
                    before, here, after = table[k - 1, x], table[k, x], table[k + 1, x]
                    curve = before - 2 * here + after
                    vertex = 0.5 * (before - after) / curve if curve > 0 else 0.0
                    disparity[y, x] = least + (k + vertex) * RASTER_PX
    return disparity


@numba.njit(fastmath=True, error_model="numpy")
def line_sums(epi, u, d):
    """Sums over the frames along the line of pixel u: (frames, i, g, ig, gg) of the values i and their slopes g by d.

    Keys' cubic convolution. Values are less that of the first frame, so that sums in f32 keep their digits.
    """
    frames, columns = epi.shape
    flat = epi.reshape(-1)
    step = np.float32(d / (frames - 1))
    begin, end = 0, frames
    if not 1 <= u + d < columns - 2 and d != 0:
        seen = (columns - 2.001 - u if d > 0 else 1 - u) / d * (frames - 1)
        end = max(0, min(frames, int(seen) + 1))
    if not 1 <= u < columns - 2:
        end = 0
    own = epi[0, u]
    half, i, g, ig, gg = np.float32(0.5), np.float32(0), np.float32(0), np.float32(0), np.float32(0)
    scale = np.float32(1 / (frames - 1))
    for t in range(begin, end):
        place = np.float32(u) + step * np.float32(t)
        whole = np.int32(place)
        f = place - np.float32(whole)
        at = np.uint32(np.int32(t) * np.int32(columns) + whole)
        a, b, c, e = flat[at - np.uint32(1)], flat[at], flat[at + np.uint32(1)], flat[at + np.uint32(2)]
        one = half * (c - a)
        two = a - np.float32(2.5) * b + np.float32(2) * c - half * e
        three = np.float32(1.5) * (b - c) + half * (e - a)
        value = b - own + f * (one + f * (two + f * three))
        slope = (one + f * (np.float32(2) * two + np.float32(3) * f * three)) * (np.float32(t) * scale)
        i += value
        g += slope
        ig += value * slope
        gg += slope * slope
    return end, i, g, ig, gg


@numba.njit(fastmath=True, error_model="numpy")
def normal_equations(volume, y, x, guess, slope_x, slope_y, matrix, vector):
    """Gauss-Newton's equations for (d, dd/dx, dd/dy) at one pixel, over its window and all frames; how many pixels took part."""
    rows, frames, columns = volume.shape
    matrix[:] = 0
    vector[:] = 0
    used = 0
    for v in range(max(y - RADIUS, 0), min(y + RADIUS + 1, rows)):
        for u in range(max(x - RADIUS, 0), min(x + RADIUS + 1, columns)):
            n, i, g, ig, gg = line_sums(volume[v], u, guess + slope_x * (u - x) + slope_y * (v - y))
            if 2 * n < frames:
                continue
            used += 1
            weight = gg - g * g / n
            vote = ig - i * g / n
            a, b = np.float32(u - x), np.float32(v - y)
            matrix[0] += weight
            matrix[1] += weight * a
            matrix[2] += weight * b
            matrix[3] += weight * a * a
            matrix[4] += weight * a * b
            matrix[5] += weight * b * b
            vector[0] -= vote
            vector[1] -= vote * a
            vector[2] -= vote * b
    return used


@numba.njit(parallel=True, fastmath={"reassoc", "contract", "arcp", "nsz"}, error_model="numpy")
def refine(volume, guesses):
    """The fit at every pixel; NaN where it leaves its guess by more than a pixel."""
    rows, _, columns = volume.shape
    fitted = np.full((rows, columns), np.nan, np.float32)
    for y in numba.prange(rows):
        m, r = np.empty(6, np.float64), np.empty(3, np.float64)
        for x in range(columns):
            guess = np.float64(guesses[y, x])
            if np.isnan(guess):
                continue
            d, slope_x, slope_y = guess, 0.0, 0.0
            good = True
            for _ in range(STEPS):
                if normal_equations(volume, y, x, np.float32(d), np.float32(slope_x), np.float32(slope_y), m, r) < 9:
                    good = False
                    break
                # Cramer's rule for the symmetric 3 x 3 system.
                c0 = m[3] * m[5] - m[4] * m[4]
                c1 = m[2] * m[4] - m[1] * m[5]
                c2 = m[1] * m[4] - m[2] * m[3]
                determinant = m[0] * c0 + m[1] * c1 + m[2] * c2
                if determinant <= 1e-9 * m[0] * m[3] * m[5]:
                    good = False
                    break
                d += (c0 * r[0] + c1 * r[1] + c2 * r[2]) / determinant
                e0, e1, e2 = m[0] * m[5] - m[2] * m[2], m[1] * m[2] - m[0] * m[4], m[0] * m[3] - m[1] * m[1]
                slope_x += (c1 * r[0] + e0 * r[1] + e1 * r[2]) / determinant
                slope_y += (c2 * r[0] + e1 * r[1] + e2 * r[2]) / determinant
                if not abs(d - guess) < 1:
                    good = False
                    break
            if good:
                fitted[y, x] = d
    return fitted


def match(frames, range_px):
    """Disparity of every pixel of the first of `frames` (uint8, frames x rows x columns)."""
    # An EPI, the row y of all frames, lies together.
    volume = np.ascontiguousarray(frames.transpose(1, 0, 2)).astype(np.float32)
    least, largest = range_px
    count = int(round((largest - least) / RASTER_PX)) + 1
    return refine(volume, search(volume, least, count, 16))


def compile_all():
    """Compiles everything, so that no timing contains it."""
    match(np.random.default_rng(1).integers(0, 255, (5, 12, 64)).astype(np.uint8), (0.0, 3.0))
