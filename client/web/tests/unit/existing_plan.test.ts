import { create } from "@bufbuild/protobuf";
import { expect, test } from "vitest";
import {
  GetSitePriorResponseSchema,
  SitePriorFormat,
  SitePriorSchema,
  SitePriorStandingSchema,
  SitePriorState,
} from "../../src/gen/vantage/v1/site_prior_pb";
import { ScanSchema } from "../../src/gen/vantage/v1/scan_pb";
import { firstScanMarks } from "../../src/draw/marks";
import type { Site } from "../../src/job/site";
import { cell, type FloorPlan } from "../../src/model/floor_plan";
import { likelyUnit, likelyYUp, wallsOf, type ChosenFile } from "../../src/prior/chosen_file";
import { dxfOutlines } from "../../src/prior/dxf_outlines";
import { meshOutlines, readObj, readPlyMesh } from "../../src/prior/mesh_outlines";
import { bounds, directionOf, extent, joined, largest, simplified } from "../../src/prior/outlines";
import { pictureOutlines } from "../../src/prior/picture_outlines";
import { atSite, misplaced, pixelSize, pointOf, tellScale, unitThatFits, type Pair } from "../../src/prior/placement";
import { priorKind } from "../../src/prior/prior_kind";
import { unmeasured } from "../../src/prior/unmeasured";
import english from "../../src/texts/en.json";
import { fill } from "../../src/texts/texts.svelte";
import { existingVerdict } from "../../src/words/existing_plan_words";
import { emptySite } from "./empty_site";

const bytes = (text: string) => Uint8Array.from(text, (character) => character.charCodeAt(0));
const say = (key: keyof typeof english, parameters = {}) => fill(english[key], parameters, "en");

test("a file is told by how it begins", () => {
  for (const [head, kind] of [
    ["", "empty"],
    ["\x89PNG\r\n\x1a\n", "picture"],
    ["\xff\xd8\xff\xe0", "picture"],
    ["RIFF\x10\0\0\0WEBPVP8 ", "picture"],
    ["%PDF-1.4", "pdf"],
    ["AC1032", "dwg"],
    ["AutoCAD Binary DXF\r\n", "dwg"],
    ["  0\r\nSECTION\r\n  2\r\nHEADER\r\n", "dxf"],
    ["999\nmade by hand\n0\nSECTION\n2\nENTITIES\n", "dxf"],
    ["# a house\nv 0 0 0\nv 1 0 0\n", "obj"],
    ["ply\nformat ascii 1.0\nelement vertex 3\nelement face 1\nend_header\n", "ply"],
    ["ply\nformat ascii 1.0\nelement vertex 3\nend_header\n", "scan"],
    ["ply\nformat ascii 1.0\nelement vertex 3\nelement face 0\nend_header\n", "scan"],
    ["ASTM-E57", "scan"],
    ["hello", "unknown"],
  ] as const)
    expect(priorKind(bytes(head)), JSON.stringify(head)).toBe(kind);
  // What the browser knows and this page does not.
  expect(priorKind(bytes("\0\0\0\x18ftypheic"), "image/heic")).toBe("picture");
});

// A room of 60 by 40 pixels, walls 4 thick, with a door of 10 in the lower one, and a letter in it.
function room() {
  const [width, height] = [80, 60];
  const grey = new Uint8Array(width * height).fill(255);
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) {
      const within = x >= 10 && x < 70 && y >= 10 && y < 50;
      const inside = x >= 14 && x < 66 && y >= 14 && y < 46;
      const door = y >= 46 && x >= 30 && x < 40;
      if (within && !inside && !door) grey[y * width + x] = 60;
    }
  }
  grey[30 * width + 40] = 0;
  return { width, height, grey };
}

test("of a picture what is dark is wall, without letters, as lines with corners", () => {
  const outlines = pictureOutlines(room(), 0.5);
  // One wall that a door opens: a single ring, with eight corners and the four of the door.
  expect(outlines.length).toBe(1);
  const [ring] = outlines;
  expect(ring![0]).toEqual(ring!.at(-1));
  expect(bounds(ring!)).toEqual([
    { x: 10, y: -50 },
    { x: 70, y: -10 },
  ]);
  const corners = ring!.map(({ x, y }) => `${x} ${-y}`);
  for (const corner of ["10 10", "70 10", "70 50", "14 14", "66 46", "30 50", "30 46", "40 46"])
    expect(corners).toContain(corner);
  expect(ring!.length).toBeLessThanOrEqual(13 + 1);
  // Grey walls are none where only black ones count.
  expect(pictureOutlines(room(), 0.1)).toEqual([]);
});

const dxf = (entities: string, insunits = "4") =>
  `0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1015\n9\n$INSUNITS\n70\n${insunits}\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n${entities}0\nENDSEC\n0\nEOF\n`;
const line = (layer: string, ...[x0, y0, x1, y1]: number[]) =>
  `0\nLINE\n8\n${layer}\n10\n${x0}\n20\n${y0}\n11\n${x1}\n21\n${y1}\n`;

test("of a drawing lines and polylines are walls, but for layers that are named otherwise", () => {
  const drawn = dxfOutlines(
    dxf(
      line("WAND", 0, 0, 4000, 0) +
        line("WAND", 4000, 0, 4000, 3000) +
        line("TUEREN", 500, 0, 500, 900) +
        line("Moebel", 1, 1, 2, 2) +
        "0\nLWPOLYLINE\n8\n0\n90\n3\n70\n1\n10\n0\n20\n5000\n10\n1000\n20\n5000\n10\n1000\n20\n6000\n",
    ),
  );
  expect(drawn.unit).toBe(0.001);
  // The two lines that meet are one, and the closed polyline is another.
  expect(drawn.outlines.map((outline) => outline.length).sort()).toEqual([3, 4]);
  expect(bounds(drawn.outlines.flat())).toEqual([
    { x: 0, y: 0 },
    { x: 4000, y: 6000 },
  ]);
  expect(dxfOutlines(dxf("", "0"))).toEqual({ outlines: [], unit: 0 });
});

test("blocks are drawn where they are inserted, and arcs of polylines are round", () => {
  const block = `0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n8\n0\n2\nstair\n10\n1\n20\n0\n${line("0", 1, 0, 3, 0)}0\nENDBLK\n0\nENDSEC\n`;
  const inserted = "0\nINSERT\n8\n0\n2\nstair\n10\n10\n20\n10\n41\n2\n42\n2\n50\n90\n";
  const [stair] = dxfOutlines(block + dxf(inserted)).outlines;
  expect(stair![0]!.x).toBeCloseTo(10);
  expect(stair![0]!.y).toBeCloseTo(10);
  expect(stair![1]!.x).toBeCloseTo(10);
  expect(stair![1]!.y).toBeCloseTo(14);
  // Three quarters of a circle of radius 1 about (1, 1), counter-clockwise.
  const vertex = (x: number, y: number, bulge: number) => `0\nVERTEX\n8\n0\n10\n${x}\n20\n${y}\n42\n${bulge}\n`;
  const bulge = Math.tan((3 * Math.PI) / 8);
  const arc = `0\nPOLYLINE\n8\n0\n66\n1\n70\n0\n${vertex(1, 0, bulge)}${vertex(0, 1, 0)}0\nSEQEND\n`;
  const [round] = dxfOutlines(dxf(arc)).outlines;
  expect(round!.length).toBe(9);
  for (const { x, y } of round!) expect(Math.hypot(x - 1, y - 1)).toBeCloseTo(1);
  expect(Math.max(...round!.map(({ x }) => x))).toBeGreaterThan(1.9);
});

// A box of 5 by 4 m and 2.5 m high, as OBJ with z or y up.
function box(yUp: boolean): string {
  const corners = [0, 2.5].flatMap((z) =>
    [
      [0, 0],
      [5, 0],
      [5, 4],
      [0, 4],
    ].map(([x, y]) => (yUp ? `v ${x} ${z} ${-y!}` : `v ${x} ${y} ${z}`)),
  );
  const faces = ["1 2 3 4", "5//1 6//1 7//1 8//1", "1 2 6 5", "2 3 7 6", "3 4 8 7", "-5 -8 -4 -1"];
  return [...corners, ...faces.map((face) => `f ${face}`)].join("\n");
}

test("a model is cut over its furniture, whichever axis points up", () => {
  for (const yUp of [false, true]) {
    const mesh = readObj(box(yUp));
    expect(mesh.triangles.length).toBe(36);
    const { outlines, floor } = meshOutlines(mesh, 1, yUp);
    expect(floor).toBe(0);
    expect(outlines.length).toBe(1);
    const [min, max] = bounds(outlines[0]!);
    expect([min.x, min.y, max.x, max.y].map((v) => Math.round(v * 1e6) / 1e6)).toEqual([0, 0, 5, 4]);
    const file: ChosenFile = { name: "", bytes: new Uint8Array(), kind: "obj", mesh };
    expect(likelyYUp(file)).toBe(yUp);
    expect(likelyUnit(file)).toBe(1);
    expect(wallsOf(file, { unit: 1, yUp, darkest: 0.5 }).outlines).toEqual(outlines);
  }
  const large = readObj(box(false).replace(/\d+(\.\d+)?(?=[ \n])/g, (n) => n));
  expect(
    likelyUnit({
      name: "",
      bytes: new Uint8Array(),
      kind: "obj",
      mesh: { ...large, vertices: large.vertices.map((v) => 1000 * v) },
    }),
  ).toBe(0.001);
});

test("a PLY mesh is read as text and as either kind of binary, and not where a part is missing", () => {
  const head = (format: string) =>
    `ply\nformat ${format} 1.0\ncomment x\nelement vertex 3\nproperty float x\nproperty double y\nproperty float z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n`;
  const text = bytes(`${head("ascii")}0 0 0 9\n1 2 0 9\n0 1 3 9\n3 0 1 2\n`);
  for (const little of [true, false]) {
    const start = bytes(head(little ? "binary_little_endian" : "binary_big_endian"));
    const binary = new Uint8Array(start.length + 3 * 17 + 13);
    binary.set(start);
    const view = new DataView(binary.buffer, start.length);
    [
      [0, 0, 0],
      [1, 2, 0],
      [0, 1, 3],
    ].forEach(([x, y, z], i) => {
      view.setFloat32(17 * i, x!, little);
      view.setFloat64(17 * i + 4, y!, little);
      view.setFloat32(17 * i + 12, z!, little);
    });
    view.setUint8(51, 3);
    [0, 1, 2].forEach((corner, i) => view.setInt32(52 + 4 * i, corner, little));
    expect(readPlyMesh(binary)).toEqual(readPlyMesh(text));
    expect(() => readPlyMesh(binary.subarray(0, binary.length - 1))).toThrow();
  }
  expect([...readPlyMesh(text).vertices]).toEqual([0, 0, 0, 1, 2, 0, 0, 1, 3]);
  expect([...readPlyMesh(text).triangles]).toEqual([0, 1, 2]);
  expect(() => readPlyMesh(text.subarray(0, text.length - 6))).toThrow();
});

test("lines are thinned, joined, and kept by their size", () => {
  const wavy = Array.from({ length: 101 }, (_, i) => ({ x: i / 10, y: i % 2 === 0 ? 0 : 0.01 }));
  expect(simplified(wavy, 0.05)).toEqual([wavy[0], wavy[100]]);
  expect(simplified(wavy, 0.005).length).toBe(101);
  const [a, b, c, d] = [0, 1, 2, 3].map((x) => ({ x, y: 0 }));
  // In any order and sense, from the middle on.
  expect(
    joined(
      [
        [b!, c!],
        [d!, c!],
        [a!, b!],
      ],
      0.01,
    ).map((whole) => whole.map(({ x }) => x)),
  ).toEqual([[0, 1, 2, 3]]);
  const long = [a!, d!];
  const short = [a!, b!];
  expect(largest([short, long], 2)).toEqual([long]);
  expect(extent(long)).toBe(3);
});

test("most walls say how a plan is held", () => {
  const turned = (degrees: number) => {
    const [c, s] = [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)];
    return [
      { x: 0, y: 0 },
      { x: 5 * c, y: 5 * s },
      { x: 5 * c - 4 * s, y: 5 * s + 4 * c },
    ];
  };
  for (const degrees of [0, 20, 75, 110, -30])
    expect((directionOf([turned(degrees)]) * 180) / Math.PI).toBeCloseTo(((degrees % 90) + 90) % 90);
});

const pair = (x: number, y: number, u: number, v: number): Pair => ({ inPlan: { x, y }, atSite: { x: u, y: v } });

test("two places say where it lies, in the coordinates that the contract has", () => {
  const at = { inPlan: { x: 30, y: -40 }, atSite: { x: 1, y: 2 } };
  const reading = { unit: 1, yUp: false, floor: 7 };
  expect(pointOf(at, { ...reading, kind: "picture" }, -1.5).prior).toMatchObject({ x: 30, y: 40, z: 0 });
  expect(pointOf(at, { ...reading, kind: "dxf" }, -1.5).prior).toMatchObject({ x: 30, y: -40, z: 0 });
  expect(pointOf(at, { ...reading, kind: "obj" }, -1.5).prior).toMatchObject({ x: 30, y: -40, z: 7 });
  const up = pointOf(at, { ...reading, kind: "ply", yUp: true }, -1.5);
  expect(up.prior).toMatchObject({ x: 30, y: 7, z: 40 });
  expect(up.site).toMatchObject({ x: 1, y: 2, z: -1.5 });
});

test("where the first scan is to be made is marked until there is one, if the plan was placed by it", () => {
  const at = (x: number, y: number) => ({ site: { x, y, z: -1.5 } });
  const placed = (...points: { site: { x: number; y: number; z: number } }[]): Site => ({
    ...emptySite,
    prior: create(SitePriorSchema, { points }),
  });
  expect(firstScanMarks(placed(at(0, 0), at(2.5, 0))).map((mark) => [mark.type, mark.x, mark.y])).toEqual([
    ["pose", 0, 0],
  ]);
  expect(firstScanMarks(placed(at(0, 0), at(2.5, 1)))).toEqual([]);
  expect(firstScanMarks(placed(at(3, 0), at(2.5, 0)))).toEqual([]);
  expect(firstScanMarks({ ...placed(at(0, 0), at(2.5, 0)), scans: [create(ScanSchema, { name: "a" })] })).toEqual([]);
  expect(firstScanMarks(emptySite)).toEqual([]);
});

test("a distance gives a picture its scale, and what cannot be is said before it is sent", () => {
  const [a, b] = [pair(0, 0, 0, 0), pair(300, -400, 0, 9)];
  expect(pixelSize(a, b, 10)).toBeCloseTo(0.02);
  expect(pixelSize(a, b, undefined)).toBeCloseTo(0.018);
  expect(misplaced(a, b, 0.02)).toBe("");
  expect(misplaced(a, b, 0.03)).toBe("scale");
  expect(misplaced(a, pair(300, -400, 0, 0.5), 0.001)).toBe("near");
  // Without a distance a picture has its scale by the places alone.
  expect(tellScale(a, b)).toBe(true);
  expect(tellScale(a, pair(300, -400, 0, 4.9))).toBe(false);
  expect(tellScale(a, pair(30, -39, 0, 9))).toBe(false);
  expect(tellScale(a, pair(30, -40, 3, 4))).toBe(true);
  // In millimetres.
  expect(unitThatFits(pair(0, 0, 0, 0), pair(9100, 0, 9, 0.3))).toBe(0.001);
  expect(unitThatFits(pair(0, 0, 0, 0), pair(77, 0, 9, 0.3))).toBeUndefined();
});

const standing = (state: SitePriorState, more = {}) => create(SitePriorStandingSchema, { state, scale: 1, ...more });

test("its walls lie where the server has them, without what is a letter in a picture", () => {
  const answer = (format: SitePriorFormat) =>
    create(GetSitePriorResponseSchema, {
      sitePrior: { format },
      walls: [
        {
          corners: [
            { x: 10, y: 20, z: 2.8 },
            { x: 14, y: 22, z: 2.8 },
          ],
        },
        {
          corners: [
            { x: 1, y: 1, z: 0 },
            { x: 1.5, y: 1, z: 0 },
          ],
        },
        { corners: [{ x: 1, y: 1, z: 0 }] },
      ],
    });
  expect(atSite(answer(SitePriorFormat.DXF)).map(({ floor }) => floor)).toEqual([2.8, 0]);
  const [wall, ...others] = atSite(answer(SitePriorFormat.PICTURE));
  expect(others).toEqual([]);
  expect(wall).toEqual({
    outline: [
      { x: 10, y: 20 },
      { x: 14, y: 22 },
    ],
    floor: 2.8,
  });
  expect(atSite(create(GetSitePriorResponseSchema, {}))).toEqual([]);
});

test("what is measured is not drawn as expected any more", () => {
  const [columns, rows, size] = [200, 40, 0.05];
  const cells = new Uint8Array(columns * rows);
  // A wall along y = 1 from x = 0 to 3, 0.1 m off where it was drawn, and floor that was seen from 6 to 8.
  for (let x = 0; x < 60; ++x) cells[20 * columns + x] = cell.wall;
  for (let x = 120; x < 160; ++x) for (let y = 15; y < 25; ++y) cells[y * columns + x] = cell.floor;
  const plan: FloorPlan = { x: 0, y: 0, size, columns, rows, cells, missing: cells, direction: 0, extent: [] };
  const wall = [
    { x: -2, y: 1.1 },
    { x: 12, y: 1.1 },
  ];
  const left = unmeasured([wall], plan);
  const spans = left.map((piece) => [piece[0]!.x, piece.at(-1)!.x].map((x) => Math.round(10 * x) / 10));
  expect(spans.length).toBe(3);
  expect(spans[0]![0]).toBe(-2);
  expect(spans[0]![1]).toBeCloseTo(0, 0);
  expect(spans[1]).toEqual([3.2, 6]);
  expect(spans[2]![0]).toBe(8);
  // What is outside of all that is known stays as it is.
  expect(unmeasured([wall], undefined)).toEqual([wall]);
  // What is left between measured walls, less than half a metre, does not.
  const gap = [
    { x: 2.9, y: 1.1 },
    { x: 3.6, y: 1.1 },
  ];
  expect(unmeasured([gap], plan)).toEqual([]);
});

test("how it stands is said in words, with the cure", () => {
  const words = (state: SitePriorState, more = {}) => existingVerdict(standing(state, more), say, "en");
  const aligned = words(SitePriorState.ALIGNED, {
    residualM: 0.03,
    agreeingShare: 0.97,
    wallAreaM2: 14.1,
    refutedShare: 0.12,
    newAreaM2: 3,
    scale: 1.015,
  });
  expect(aligned).toEqual({
    standing: "good",
    words: "aligned to 3\u00a0cm",
    more: [
      "Of 14\u00a0m² of scanned walls 97\u00a0% lie on it.",
      "12\u00a0% of its walls that were looked at are not there; it is not used there.",
      "3.0\u00a0m² of walls are new: it does not have them.",
      "It was 1\u00a0% too small; that is put right.",
    ],
  });
  const not = words(SitePriorState.NOT_ALIGNED);
  expect([not.standing, not.words]).toEqual(["bad", "not aligned: unused"]);
  expect(not.more.join(" ")).toMatch(/Choose it again and place it/);
  expect(words(SitePriorState.REFUTED, { refutedShare: 0.4 }).more[0]).toMatch(/^40\s% of its walls/);
  expect(words(SitePriorState.NOT_ENOUGH_SEEN).standing).toBe("unknown");
  const unusable = words(SitePriorState.UNUSABLE);
  expect([unusable.standing, unusable.words]).toEqual(["bad", "cannot be used"]);
  expect(unusable.more.join(" ")).toMatch(/Choose it again; if it stays so, simplify it, or take it out/);
  expect(existingVerdict(undefined, say, "en").words).toBe("being compared");
});
