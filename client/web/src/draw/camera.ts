// The eye that looks at the model: on a sphere around what it looks at, upright.

export interface Vector {
  x: number;
  y: number;
  z: number;
}

export interface Orbit {
  // What it looks at, m, from the surface's origin.
  target: Vector;
  // Where the eye is from there: rad from +x, rad over the horizon, m.
  azimuth: number;
  elevation: number;
  distance: number;
}

export interface View {
  eye: Vector;
  right: Vector;
  up: Vector;
  forward: Vector;
  // Pixels for a tangent of 1, and of the picture.
  focal: number;
  width: number;
  height: number;
}

// What is nearer than this is not drawn, m.
export const near = 0.1;
// Of the higher side of the picture, rad.
const fieldOfView = 0.95;
const [lowest, highest] = [-0.3, 1.55];
const [nearest, farthest] = [0.5, 2000];

export function viewOf(orbit: Orbit, width: number, height: number): View {
  const [ca, sa] = [Math.cos(orbit.azimuth), Math.sin(orbit.azimuth)];
  const [ce, se] = [Math.cos(orbit.elevation), Math.sin(orbit.elevation)];
  const forward = { x: -ce * ca, y: -ce * sa, z: -se };
  const right = { x: -sa, y: ca, z: 0 };
  const up = { x: -se * ca, y: -se * sa, z: ce };
  const eye = {
    x: orbit.target.x - orbit.distance * forward.x,
    y: orbit.target.y - orbit.distance * forward.y,
    z: orbit.target.z - orbit.distance * forward.z,
  };
  return { eye, right, up, forward, focal: Math.max(width, height) / 2 / Math.tan(fieldOfView / 2), width, height };
}

export interface Pixel {
  x: number;
  y: number;
  // Along the line of sight, m; not in front of the eye where it is below `near`.
  depth: number;
}

export function projectPoint(view: View, point: Vector): Pixel {
  const [x, y, z] = [point.x - view.eye.x, point.y - view.eye.y, point.z - view.eye.z];
  const depth = x * view.forward.x + y * view.forward.y + z * view.forward.z;
  const scale = view.focal / depth;
  return {
    x: view.width / 2 + scale * (x * view.right.x + y * view.right.y),
    y: view.height / 2 - scale * (x * view.up.x + y * view.up.y + z * view.up.z),
    depth,
  };
}

// Turned by a thumb that moved so many pixels of a picture so high.
export function turned(orbit: Orbit, dx: number, dy: number, height: number): Orbit {
  const angle = Math.PI / Math.max(200, height);
  return {
    ...orbit,
    azimuth: orbit.azimuth - dx * angle * 1.4,
    elevation: Math.min(highest, Math.max(lowest, orbit.elevation + dy * angle)),
  };
}

// Moved so that what is looked at stays below the fingers.
export function moved(orbit: Orbit, dx: number, dy: number, view: View): Orbit {
  const scale = orbit.distance / view.focal;
  const { right, up } = view;
  return {
    ...orbit,
    target: {
      x: orbit.target.x - scale * (dx * right.x - dy * up.x),
      y: orbit.target.y - scale * (dx * right.y - dy * up.y),
      z: orbit.target.z + scale * dy * up.z,
    },
  };
}

export function closer(orbit: Orbit, factor: number): Orbit {
  return { ...orbit, distance: Math.min(farthest, Math.max(nearest, orbit.distance / factor)) };
}

// From where all of these places are in sight, in the given direction: the nearest such place on the line to the middle
// of the box around them.
export function around(
  places: readonly Vector[],
  azimuth: number,
  elevation: number,
  width: number,
  height: number,
): Orbit {
  const middle = (of: (place: Vector) => number) => {
    let [lower, upper] = [Infinity, -Infinity];
    for (const place of places) [lower, upper] = [Math.min(lower, of(place)), Math.max(upper, of(place))];
    return places.length === 0 ? 0 : (lower + upper) / 2;
  };
  // Along the axes of the picture, so that it is filled in both.
  const { right, up, forward, focal } = viewOf(
    { target: { x: 0, y: 0, z: 0 }, azimuth, elevation, distance: 0 },
    width,
    height,
  );
  const along = (v: Vector, axis: Vector) => v.x * axis.x + v.y * axis.y + v.z * axis.z;
  const [u, v, w] = [right, up, forward].map((axis) => middle((place) => along(place, axis))) as [
    number,
    number,
    number,
  ];
  const target = {
    x: u * right.x + v * up.x + w * forward.x,
    y: u * right.y + v * up.y + w * forward.y,
    z: u * right.z + v * up.z + w * forward.z,
  };
  // With a margin of a twentieth on each side.
  const [halfWidth, halfHeight] = [0.45 * width, 0.45 * height];
  let distance = 1;
  for (const place of places) {
    const depth = along(place, forward) - w;
    distance = Math.max(
      distance,
      (Math.abs(along(place, right) - u) * focal) / halfWidth - depth,
      (Math.abs(along(place, up) - v) * focal) / halfHeight - depth,
      2 * near - depth,
    );
  }
  return { target, azimuth, elevation, distance };
}
