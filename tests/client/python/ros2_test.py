"""The page on ROS 2, as it stands, on recorded messages."""

import array
import base64
import copy
import gzip
import json
import pathlib
import re
import sys
import types
import unittest
from types import SimpleNamespace as Message

import numpy as np

import vantage
from server import ServedTest

HERE = pathlib.Path(__file__).resolve().parent
PAGE = HERE.parents[2] / "client" / "python" / "ros2.md"


def recorded():
    clouds = json.loads(gzip.decompress((HERE / "data" / "clouds.json.gz").read_bytes()),
                        object_hook=lambda item: Message(**item))
    for cloud in clouds:
        cloud.data = array.array("B", base64.b64decode(cloud.data))  # as rclpy has it
    return clouds


class Node:
    """Stands in for rclpy's: keeps what a node asks for, so that a test can call it."""

    def __init__(self, name):
        self.name, self.said, self.services, self.subscribed = name, [], {}, {}
        self.published = []

    def declare_parameter(self, name, default):
        return Message(value=self.parameters.get(name, default))

    def create_publisher(self, kind, topic, depth):
        return Message(publish=self.published.append)

    def create_service(self, kind, name, call):
        self.services[name] = call

    def create_subscription(self, kind, topic, call, depth):
        self.subscribed[topic] = call

    def get_logger(self):
        return Message(**{level: self.said.append for level in ("info", "warning", "error")})


class Buffer:
    """Of tf: the robot believes to be a bit off where it is."""

    places = {}

    def lookup_transform(self, target, source, stamp):
        x, y, heading = self.places[stamp]
        half = np.radians(heading) / 2
        return Message(transform=Message(
            translation=Message(x=x, y=y, z=0.0),
            rotation=Message(w=float(np.cos(half)), x=0.0, y=0.0, z=float(np.sin(half)))))


def pose_stamped():
    return Message(header=Message(), pose=Message(position=Message(), orientation=Message()))


STANDING_IN = {
    "rclpy": {}, "rclpy.node": {"Node": Node}, "geometry_msgs": {}, "sensor_msgs": {}, "std_srvs": {},
    "geometry_msgs.msg": {"PoseStamped": pose_stamped}, "sensor_msgs.msg": {"PointCloud2": Message},
    "std_srvs.srv": {"Trigger": Message},
    "tf2_ros": {"Buffer": Buffer, "TransformException": LookupError,
                "TransformListener": lambda buffer, node: None}}


def page():
    """What the page's listings define."""
    for name, has in STANDING_IN.items():
        sys.modules[name] = types.ModuleType(name)
        vars(sys.modules[name]).update(has)
    listings = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(), re.M | re.S)
    assert len(listings) == 2, len(listings)
    names = {}
    for listing in listings:
        exec(compile(listing, str(PAGE), "exec"), names)
    return Message(**{name: value for name, value in names.items() if name.isidentifier()})


class CloudTest(unittest.TestCase):
    def setUp(self):
        self.page = page()
        self.clouds = recorded()

    def test_becomes_a_scan(self):
        for cloud in self.clouds:
            image = self.page.image_of(cloud, most_intensity=255)
            self.assertEqual(image.ranges.shape, (cloud.height, cloud.width))
            np.testing.assert_allclose(np.diff(image.azimuth), np.radians(2.5), atol=1e-5)
            np.testing.assert_allclose(np.diff(image.elevation), np.radians(2.5), atol=1e-5)
            self.assertTrue(image.full_turn)
            share = (image.ranges == vantage.NO_RETURN).mean()
            self.assertTrue(0.01 < share < 0.03, share)
            # A place is the same by the message and by the scan, and so is how it looked.
            xyz = self.page.fields(cloud, "x", "y", "z", "intensity")
            row, column = np.argwhere(image.ranges > 0)[len(image.ranges)]
            ray = image.directions()[row, column] * image.ranges[row, column]
            off = sum((xyz[axis] - ray[i])**2 for i, axis in enumerate("xyz"))
            self.assertLess(np.nanmin(off), 1e-6)
            looked = xyz["intensity"].flat[np.nanargmin(off)]
            self.assertAlmostEqual(image.intensity[row, column] / 65535, looked / 255, delta=1e-4)

    def test_big_endian_doubles_and_padded_rows(self):
        cloud = self.clouds[1]
        wanted = self.page.image_of(cloud)
        values = self.page.fields(cloud, "x", "y", "z")
        rows = np.zeros((cloud.height, 40 * cloud.width + 24), np.uint8)
        kind = np.dtype({"names": "xyz", "formats": [">f8"] * 3, "offsets": [8, 16, 24], "itemsize": 40})
        other = np.ndarray(values.shape, kind, rows, strides=(rows.shape[1], 40))
        for axis in "xyz":
            other[axis] = values[axis]
        moved = copy.copy(cloud)
        moved.fields = [Message(name=axis, offset=8 + 8 * i, datatype=8, count=1)
                        for i, axis in enumerate("xyz")]
        moved.is_bigendian, moved.point_step, moved.row_step = True, 40, rows.shape[1]
        moved.data = rows.tobytes()
        np.testing.assert_array_equal(self.page.image_of(moved).ranges, wanted.ranges)

    def test_what_is_wrong_is_said(self):
        cloud = self.clouds[0]
        flat = copy.copy(cloud)
        flat.height, flat.width, flat.row_step = 1, cloud.height * cloud.width, len(cloud.data)
        with self.assertRaisesRegex(ValueError, "height 1"):
            self.page.image_of(flat)
        with self.assertRaisesRegex(ValueError, "no intensity, but x, y, z"):
            less = copy.copy(cloud)
            less.fields = cloud.fields[:3]
            self.page.image_of(less, most_intensity=1)
        short = copy.copy(cloud)
        short.data = cloud.data[:-100]
        with self.assertRaises((ValueError, TypeError)):
            self.page.image_of(short)


class NodeTest(ServedTest):
    def test_drives(self):
        used = page()
        Buffer.places = {0: (0.0, 0.0, 0.0), 1: (0.85, 0.45, 21.5)}
        used.ScanSender.parameters = {"server": self.server.address, "density": 50.0}
        node = used.ScanSender()
        first, second = recorded()
        node.subscribed["points"](first)
        self.assertIsNone(node.job, "not asked to")
        for cloud in (first, second):
            self.assertTrue(node.services["scan"](None, Message()).success)
            node.subscribed["points"](cloud)
            node.sending.submit(lambda: None).result()
        self.assertEqual(node.said, [])
        self.assertEqual(len(node.published), 2)
        scans = list(node.job.scans())
        np.testing.assert_allclose(vantage.matrix(scans[1].pose)[:2, 3], (0.8, 0.5), atol=0.02)
        there = node.published[0]
        self.assertEqual((there.header.frame_id, there.header.stamp), ("map", 0))
        self.assertTrue(-2 < there.pose.position.x < 4.5)
        # What is no scan is said, and the node goes on.
        second.width //= 2
        node.services["scan"](None, Message())
        second.header.stamp = 1
        second.height = 1
        node.subscribed["points"](second)
        node.sending.submit(lambda: None).result()
        self.assertIn("height 1", node.said[0])
        node.client.close()
        # A node that was started anew: a cloud whose place tf does not have yet is left, and the next
        # one goes to the same job, where it arrived before.
        anew = used.ScanSender()
        unknown = copy.copy(first)
        unknown.header = Message(frame_id="lidar", stamp=7)
        anew.services["scan"](None, Message())
        anew.subscribed["points"](unknown)
        anew.subscribed["points"](first)
        anew.sending.submit(lambda: None).result()
        # On a busy machine its plan may end without a view, and say so.
        self.assertEqual([line for line in anew.said if not line.startswith("done: ")], ["7"])
        self.assertEqual(len(list(anew.job.scans())), 2)
        anew.client.close()


if __name__ == "__main__":
    unittest.main()
