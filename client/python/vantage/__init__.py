"""Client of Vantage, which tells where a laser scanner should stand next.

    import vantage

    with vantage.connect("127.0.0.1:7464") as client:
        job = client.create_session("flat", scanner=image.scanner(), density=100)
        scan = job.upload(image).wait()
        for plan in job.plan(seconds=5):
            print(plan.revision, len(plan.result.views))

Lengths are in metres, angles in radians (headings in degrees where the name says so), frames are
right-handed with z up. Whatever the server answers is a message of `vantage.v1`, whose fields have
their unit in their name. What the server refuses is a `VantageError`.
"""

from vantage.connection import Options
from vantage.client import Client, connect
from vantage.errors import FieldViolation, VantageError
from vantage.geometry import matrix, pose, positions, prior, score_map
from vantage.plan_run import PlanRun
from vantage.range_image import NO_INFORMATION, NO_RETURN, RangeImage
from vantage.scan import Scan
from vantage.session import Session
from vantage.upload import UploadProgress
from vantage.version import VERSION as __version__

__all__ = ["NO_INFORMATION", "NO_RETURN", "Client", "FieldViolation", "Options", "PlanRun",
           "RangeImage", "Scan", "Session", "UploadProgress", "VantageError", "__version__",
           "connect", "matrix", "pose", "positions", "prior", "score_map"]
