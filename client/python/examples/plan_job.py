#!/usr/bin/python3
"""A whole job, plotted: plan_job.py [--server ADDRESS] [--scans N] [--out job.png]

A simulated scanner makes a scan of a room, asks where to go, goes there, and so on until the server
says that it is done. With a scanner of one's own, `room.scan` is what changes.
"""

import argparse
import math

import matplotlib
import numpy as np

import room
import vantage
from vantage.v1 import scan_pb2

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

START = np.array([1.8, 1.9, 1.5])  # m, in the room; the origin of the job's world


def run(client, session, most):
    """Scans until nothing is left to gain; answers the job, its images, coverage and last plans."""
    where, heading, images, areas, plans = np.zeros(3), 0.0, [], [], []
    job = None
    while len(images) < most:
        image = room.scan(START + where, heading, seed=len(images) + 1)
        if job is None:
            job = client.create_session(session, scanner=image.scanner(), density=400)
        # What is known of the pose is what was planned, and a compass.
        prior = vantage.pose(*where, heading + 2) if images else None
        merged = job.upload(image, display_name=f"scan {len(images) + 1}", prior=prior).wait()
        images.append(image)
        print(f"{merged.display_name}: {scan_pb2.ScanState.Name(merged.state)} {merged.state_message}")
        areas.append(job.coverage().coverage.area_at_density_m2)
        with job.plan(work_limit_rays=6_000_000, seed=1) as plan:
            for now in plan:
                print(f"  revision {now.revision}: {len(now.result.views)} views", end="\r")
        print(f"  {plan.latest.result.message}")
        plans.append(plan.full())
        if plan.latest.result.termination.suggested or not plan.latest.result.views:
            break
        where, heading = vantage.positions(plan.latest)[0], 25.0 * len(images)
    return job, images, areas, plans


def draw(job, images, areas, plans, path):
    figure = plt.figure(figsize=(12, 9), layout="constrained")
    top, bottom = figure.subfigures(2, 1, height_ratios=(3, 2))
    left, right = top.subplots(1, 2, width_ratios=(3, 2))
    cells = vantage.score_map(plans[0])
    order = np.argsort(cells["score"])
    dots = left.scatter(*cells["centre"][order, :2].T, c=cells["score"][order], s=14, marker="s",
                        cmap="viridis", linewidths=0)
    figure.colorbar(dots, ax=left, label="score of the first plan, samples", shrink=0.8)
    for low, high in room.BOXES:
        left.add_patch(plt.Rectangle((low - START)[:2], *(high - low)[:2], fc="0.75", ec="0.4"))
    left.add_patch(plt.Rectangle(-START[:2], *room.ROOM[:2], fill=False, lw=2))
    stations = np.array([vantage.matrix(scan.pose)[:3, 3] for scan in job.scans()
                         if scan.state == scan_pb2.SCAN_STATE_MERGED])
    left.plot(*stations[:, :2].T, "o-", color="crimson", ms=9)
    for number, at in enumerate(stations, 1):
        left.annotate(f"{number}", at[:2], xytext=(7, 7), textcoords="offset points",
                      color="crimson", weight="bold")
    left.set(aspect="equal", xlabel="x, m", ylabel="y, m", title="Stations, over where they were sought")
    right.bar(range(1, len(areas) + 1), areas, color="steelblue")
    for number, area in enumerate(areas, 1):
        right.annotate(f"{area:.0f}", (number, area), ha="center", va="bottom")
    right.set(xlabel="scans", xticks=range(1, len(areas) + 1), ylabel="m² at 400 samples / m²",
              title="What they brought")
    first = images[0]
    picture = bottom.subplots()
    shown = picture.pcolormesh(np.degrees(first.azimuth), np.degrees(first.elevation),
                               np.where(first.ranges > 0, first.ranges, math.nan), cmap="magma")
    bottom.colorbar(shown, ax=picture, label="range, m")
    picture.set(xlabel="azimuth, degrees", ylabel="elevation, degrees", title="The first scan")
    figure.savefig(path, dpi=100)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--server", default="127.0.0.1:7464")
    parser.add_argument("--session", default="", help="its id; chosen by the server when left out")
    parser.add_argument("--scans", type=int, default=6, help="at most")
    parser.add_argument("--out", default="job.png")
    given = parser.parse_args(arguments)
    with vantage.connect(given.server) as client:
        draw(*run(client, given.session, given.scans), given.out)
    print(f"drawn: {given.out}")


if __name__ == "__main__":
    main()
