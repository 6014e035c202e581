"""Range images: their encoding is that of core, their checks name what is wrong."""

import math
import struct
import unittest

import numpy as np

import room
import vantage
import vantage_core
from vantage.crc32c import crc32c


def looked(image):
    """With intensity and colour."""
    rng = np.random.default_rng(1)
    return vantage.RangeImage(
        image.azimuth, image.elevation, image.ranges,
        intensity=rng.integers(0, 1 << 16, image.ranges.shape, np.uint16),
        colour=rng.integers(0, 256, (*image.ranges.shape, 3), np.uint8))


class EncodingTest(unittest.TestCase):
    def image(self):
        """With all that a cell can hold, and uneven axes."""
        image = room.scan((1.8, 1.9, 1.5), step=3)
        image.ranges[2, 5:9] = vantage.NO_RETURN
        image.ranges[:3, ::7] = vantage.NO_INFORMATION
        image.ranges[10, 10], image.ranges[10, 11] = 1e-5, 1000
        image.ranges[11, 11], image.ranges[:, 12] = 1001, vantage.NO_RETURN
        image.azimuth[3:] += 1e-3
        return vantage.RangeImage(image.azimuth, image.elevation, image.ranges)

    def test_is_that_of_core_to_the_bit(self):
        image = self.image()
        data = image.to_bytes()
        core = vantage_core.RangeImage.from_bytes(data)
        self.assertEqual(core.to_bytes(), data)
        np.testing.assert_array_equal(core.ranges, vantage.RangeImage.from_bytes(data).ranges)
        np.testing.assert_array_equal(core.azimuth, image.azimuth)
        self.assertEqual(core.ranges[10, 10], np.float32(1e-4), "never rounded to no return")
        self.assertEqual(core.ranges[10, 11], np.float32(1000))
        self.assertEqual(core.ranges[11, 11], 0, "beyond 1 km")

    def test_comes_back(self):
        image = looked(self.image())
        again = vantage.RangeImage.from_bytes(image.to_bytes())
        measured = (image.ranges > 0) & (image.ranges <= 1000)
        np.testing.assert_allclose(again.ranges[measured], image.ranges[measured], atol=1.1e-4)
        np.testing.assert_array_equal(again.ranges[~measured & (image.ranges <= 0)],
                                      image.ranges[~measured & (image.ranges <= 0)])
        np.testing.assert_array_equal(again.intensity, np.where(measured, image.intensity, 0))
        np.testing.assert_array_equal(again.colour, np.where(measured[..., None], image.colour, 0))
        self.assertEqual(again.full_turn, True)
        self.assertEqual(again.to_bytes(), image.to_bytes())

    def test_every_cut_is_refused(self):
        data = self.image().to_bytes()
        for cut in (b"", data[:10], data[:31], data[:-1], data + b"0"):
            with self.assertRaisesRegex(ValueError, "header|cut off or padded"):
                vantage.RangeImage.from_bytes(cut)
        for at, byte in ((4, 2), (6, 0x80)):
            with self.assertRaisesRegex(ValueError, "newer"):
                vantage.RangeImage.from_bytes(data[:at] + bytes([byte]) + data[at + 1:])
        # A header may not make it take memory.
        with self.assertRaisesRegex(ValueError, "no image"):
            vantage.RangeImage.from_bytes(data[:8] + struct.pack("<II", 1 << 31, 1 << 31) + data[16:])

    def test_crc32c(self):
        table = [0] * 256
        for byte in range(256):
            crc = byte
            for _ in range(8):
                crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
            table[byte] = crc
        rng = np.random.default_rng(2)
        self.assertEqual(crc32c(b"123456789"), 0xE3069283)
        for size in (0, 1, 8191, 8192, 8193, 70001, 262144):
            data = rng.integers(0, 256, size, np.uint8).tobytes()
            crc = 0xFFFFFFFF
            for byte in data:
                crc = crc >> 8 ^ table[(crc ^ byte) & 255]
            self.assertEqual(crc32c(data), crc ^ 0xFFFFFFFF, size)


class ChecksTest(unittest.TestCase):
    def test_names_what_is_wrong(self):
        good = {"azimuth": np.radians([-90, 0, 90]), "elevation": np.radians([-10, 10]),
                "ranges": np.ones((2, 3))}
        vantage.RangeImage(**good)
        for change, says in (
                ({"azimuth": np.radians([0, -90, 90])}, "azimuth.*rise strictly"),
                ({"azimuth": np.radians([-180, 0, 180])}, "azimuth.*full turn"),
                ({"elevation": np.array([-10, 10])}, "elevation.*radians"),
                ({"elevation": np.radians([10])}, "elevation.*two at least"),
                ({"ranges": np.ones((3, 2))}, r"ranges.*\(rows, columns\) \(2, 3\)"),
                ({"ranges": np.full((2, 3), np.nan)}, "ranges.*NO_RETURN"),
                ({"ranges": np.full((2, 3), -2.0)}, "ranges.*NO_INFORMATION"),
                ({"ranges": np.zeros((2, 3))}, "no cell holds a range"),
                ({"intensity": np.zeros((2, 3))}, "intensity.*uint16"),
                ({"colour": np.zeros((2, 3), np.uint8)}, r"colour.*\(2, 3, 3\)"),
                ({"native_azimuth_step": 0.0}, "native_azimuth_step")):
            with self.assertRaisesRegex(ValueError, says):
                vantage.RangeImage(**{**good, **change})

    def test_full_turn(self):
        self.assertTrue(room.scan((1, 1, 1), step=6).full_turn)
        azimuth = np.radians(np.arange(-60, 60, 6))
        sector = vantage.RangeImage(azimuth, np.radians([0, 6]), np.ones((2, 20)))
        self.assertFalse(sector.full_turn)
        self.assertAlmostEqual(math.degrees(sector.scanner().azimuth_span_rad), 120)

    def test_scanner_is_the_one_that_core_fits(self):
        image = room.scan((1.8, 1.9, 1.5), step=3)
        image.ranges[:5] = vantage.NO_INFORMATION
        mine, cores = image.scanner(), vantage_core.Scanner.of(image)
        self.assertAlmostEqual(mine.azimuth_span_rad, cores.azimuth_span)
        self.assertAlmostEqual(mine.min_elevation_rad, cores.elevation_min)
        self.assertAlmostEqual(mine.max_elevation_rad, cores.elevation_max)
        self.assertAlmostEqual(mine.azimuth_step_rad, cores.azimuth_step)


class OrganisedTest(unittest.TestCase):
    def cloud(self, image):
        return np.where((image.ranges > 0)[..., None], image.directions() * image.ranges[..., None],
                        np.nan)

    def test_any_order_of_lines_and_shots(self):
        image = room.scan((1.8, 1.9, 1.5), step=3)
        image.ranges[7, 20:30] = vantage.NO_RETURN
        image.ranges[:, 40] = vantage.NO_RETURN  # nothing tells this shot's direction
        image.ranges[0] = vantage.NO_RETURN
        cloud = self.cloud(image)
        for turned in (cloud, cloud[::-1], cloud[:, ::-1], np.roll(cloud, 33, axis=1),
                       np.nan_to_num(cloud)):
            again = vantage.RangeImage.from_points(turned)
            np.testing.assert_allclose(np.diff(again.azimuth), np.radians(3), atol=1e-6)
            np.testing.assert_allclose(again.elevation, image.elevation, atol=1e-6)
            # Where a turn begins is not told; the same samples are there.
            self.assertEqual((again.ranges > 0).sum(), (image.ranges > 0).sum())
            np.testing.assert_allclose(sorted(map(tuple, np.round(again.points(), 4))),
                                       sorted(map(tuple, np.round(image.points(), 4))), atol=2e-4)

    def test_what_is_no_grid_is_refused(self):
        cloud = self.cloud(room.scan((1.8, 1.9, 1.5), step=3))
        staggered = np.stack([np.roll(line, i % 4, axis=0) for i, line in enumerate(cloud)])
        with self.assertRaisesRegex(ValueError, "degrees or more off the grid.*destaggered"):
            vantage.RangeImage.from_points(staggered)
        with self.assertRaisesRegex(ValueError, "off the grid|two lines"):
            vantage.RangeImage.from_points(cloud + (3, 0, 0))  # in the world's frame
        with self.assertRaisesRegex(ValueError, "height 1"):
            vantage.RangeImage.from_points(cloud.reshape(1, -1, 3))
        with self.assertRaisesRegex(ValueError, "nothing came back"):
            vantage.RangeImage.from_points(np.zeros((4, 4, 3)))


if __name__ == "__main__":
    unittest.main()
