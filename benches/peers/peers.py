"""Other people's programs on the first and the last frame. Each gives the disparity of every pixel of the first frame, NaN: none."""

import tempfile
from pathlib import Path

import cv2
import numpy as np


def sgbm(first, last, range_px):
    """OpenCV's semi-global matching. Points move to the right here; mirrored, they move to the left, as it expects."""
    least, largest = (int(value) for value in range_px)
    side = 5
    matcher = cv2.StereoSGBM_create(
        minDisparity=least,
        numDisparities=-(-(largest - least) // 16) * 16,
        blockSize=side,
        P1=8 * side**2,
        P2=32 * side**2,
        disp12MaxDiff=1,
        uniquenessRatio=5,
        mode=cv2.StereoSGBM_MODE_HH,
    )
    mirrored = matcher.compute(np.ascontiguousarray(first[:, ::-1]), np.ascontiguousarray(last[:, ::-1]))
    disparity = mirrored[:, ::-1] / 16.0
    return np.where(disparity < least, np.nan, disparity)


def dis_flow(first, last):
    """OpenCV's DIS optical flow, set for accuracy: down to full resolution, dense patches, 50 descents, refined."""
    flow = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    flow.setFinestScale(0)
    flow.setPatchStride(2)
    flow.setGradientDescentIterations(50)
    flow.setVariationalRefinementIterations(10)
    return flow.calc(first, last, None)[..., 0].astype(float)


def pyvale_dic(first, last, range_px, threads, subset_px):
    """pyvale's digital image correlation: affine subsets around every pixel, ZNSSD, cubic B-splines, from one seed."""
    import pyvale.dic as dic

    rows, columns = first.shape
    with tempfile.TemporaryDirectory() as folder:
        dic.calculate_2d(
            first,
            last[None],
            np.ones(first.shape, bool),
            seed=[columns // 3, rows // 2],
            subset_size=subset_px,
            subset_step=1,
            max_displacement=int(2 ** np.ceil(np.log2(range_px[1]))),
            num_threads=threads,
            image_filter_kernel=1,
            output_basepath=folder,
            output_binary=True,
            print_level=0,
        )
        file = next(Path(folder).iterdir())
        results = dic.import_2d([file], delimiter=",", binary=True, layout="column", print_level=0)
    disparity = np.full(first.shape, np.nan)
    answer = np.where(results.converged[0], results.u_px[0], np.nan)
    disparity[results.ss_y.astype(int), results.ss_x.astype(int)] = answer
    return disparity
