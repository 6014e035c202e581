// The surface of the model as the server exports it (EXPORT_FORMAT_SURFACE_PLY): one element for each
// voxel of surface, read while it arrives.
import { bytesOf, readScalar } from "./ply_scalars";

// As SurfaceKind.
export const kind = { measured: 1, hidden: 2, noEcho: 3, outside: 4 } as const;

export interface Surface {
  count: number;
  // Added to `xyz` gives world coordinates, m: georeferenced sites keep their precision.
  origin: { x: number; y: number; z: number };
  // Three for each element, m, from `origin`.
  xyz: Float32Array;
  // Unit normals, three for each element, of 127.
  normal: Int8Array;
  // SurfaceKind.
  kind: Uint8Array;
  // Samples / m2.
  density: Float32Array;
  // m2.
  area: Float32Array;
  // 1 where no scan will bring more.
  givenUp: Uint8Array;
}

interface Header {
  count: number;
  // Bytes of an element.
  stride: number;
  // Where its properties are in it.
  properties: Map<string, { at: number; type: string }>;
}

// Of the vertices of a binary little-endian PLY file. Undefined while the header is not whole; an error
// where it is none that can be read.
export function readHeader(bytes: Uint8Array): { header: Header; length: number } | undefined {
  const text = new TextDecoder("latin1").decode(bytes.subarray(0, 65_536));
  const end = /end_header\r?\n/.exec(text);
  if (end === null) {
    if (!"ply".startsWith(text.slice(0, 3)) || text.length >= 65_536) throw new Error("not a PLY file");
    return undefined;
  }
  const header: Header = { count: 0, stride: 0, properties: new Map() };
  let within = false;
  let binary = false;
  for (const line of text.slice(0, end.index).split(/\r?\n/)) {
    const words = line.split(" ");
    if (words[0] === "format") binary = words[1] === "binary_little_endian";
    if (words[0] === "element") {
      within = words[1] === "vertex";
      if (within) header.count = Number(words[2]);
    }
    if (words[0] === "property" && within) {
      const [, type = "", name = ""] = words;
      const size = bytesOf(type);
      header.properties.set(name, { at: header.stride, type });
      header.stride += size;
    }
  }
  if (!binary || header.stride === 0 || !Number.isSafeInteger(header.count) || header.count < 0) {
    throw new Error("not a binary PLY file with vertices");
  }
  return { header, length: end.index + end[0].length };
}

// An element's vertices at most: what a tablet's memory holds.
export const mostElements = 20_000_000;

export class SurfaceReader {
  #left = new Uint8Array(0);
  #header: Header | undefined;
  #surface: Surface | undefined;
  #done = 0;

  // The next bytes of the file.
  add(bytes: Uint8Array): void {
    let data = bytes;
    if (this.#left.length > 0) {
      data = new Uint8Array(this.#left.length + bytes.length);
      data.set(this.#left);
      data.set(bytes, this.#left.length);
    }
    let at = 0;
    if (this.#header === undefined) {
      const found = readHeader(data);
      if (found === undefined) {
        this.#left = data.slice();
        return;
      }
      if (found.header.count > mostElements) throw new Error("too much surface for a page");
      this.#header = found.header;
      at = found.length;
      this.#surface = empty(found.header.count);
    }
    const { stride, count } = this.#header;
    const whole = Math.min(count - this.#done, Math.floor((data.length - at) / stride));
    this.#take(new DataView(data.buffer, data.byteOffset + at, whole * stride), whole);
    this.#left = data.slice(at + whole * stride);
  }

  // What has come of it so far; undefined: nothing yet.
  soFar(): Surface | undefined {
    return this.#surface === undefined ? undefined : { ...this.#surface, count: this.#done };
  }

  // An error where elements are missing.
  end(): Surface {
    if (this.#surface === undefined || this.#done < this.#surface.count) throw new Error("the file is not whole");
    return this.#surface;
  }

  #take(view: DataView, elements: number): void {
    const surface = this.#surface as Surface;
    const { properties, stride } = this.#header as Header;
    const column = (name: string) => {
      const property = properties.get(name);
      if (property === undefined) return () => 0;
      return (element: number) => readScalar(view, element * stride + property.at, property.type, true);
    };
    const [x, y, z] = [column("x"), column("y"), column("z")];
    const [nx, ny, nz] = [column("nx"), column("ny"), column("nz")];
    const [kinds, density, area, givenUp] = [column("kind"), column("density"), column("area"), column("given_up")];
    if (this.#done === 0 && elements > 0) {
      surface.origin = { x: Math.round(x(0)), y: Math.round(y(0)), z: Math.round(z(0)) };
    }
    const { origin } = surface;
    for (let i = 0; i < elements; ++i) {
      const to = this.#done + i;
      surface.xyz[3 * to] = x(i) - origin.x;
      surface.xyz[3 * to + 1] = y(i) - origin.y;
      surface.xyz[3 * to + 2] = z(i) - origin.z;
      surface.normal[3 * to] = Math.round(127 * nx(i));
      surface.normal[3 * to + 1] = Math.round(127 * ny(i));
      surface.normal[3 * to + 2] = Math.round(127 * nz(i));
      surface.kind[to] = kinds(i);
      surface.density[to] = density(i);
      surface.area[to] = area(i);
      surface.givenUp[to] = givenUp(i);
    }
    this.#done += elements;
  }
}

function empty(count: number): Surface {
  return {
    count,
    origin: { x: 0, y: 0, z: 0 },
    xyz: new Float32Array(3 * count),
    normal: new Int8Array(3 * count),
    kind: new Uint8Array(count),
    density: new Float32Array(count),
    area: new Float32Array(count),
    givenUp: new Uint8Array(count),
  };
}
