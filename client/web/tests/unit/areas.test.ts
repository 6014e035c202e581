import { create } from "@bufbuild/protobuf";
import { expect, test } from "vitest";
import { areasOf, crossesItself } from "../../src/draw/areas";
import { SiteRulesSchema } from "../../src/gen/vantage/v1/planning_config_pb";

const square = [
  { x: 0, y: 0 },
  { x: 4, y: 0 },
  { x: 4, y: 3 },
  { x: 0, y: 3 },
];

test("an outline that crosses itself is told, in either sense and from any corner", () => {
  const bow = [square[0]!, square[2]!, square[1]!, square[3]!];
  const hook = [
    { x: 0, y: 0 },
    { x: 4, y: 0 },
    { x: 4, y: 4 },
    { x: 2, y: 4 },
    { x: 2, y: 2 },
    { x: 0, y: 2 },
  ];
  for (const [corners, crosses] of [
    [square, false],
    [bow, true],
    [hook, false],
    [square.slice(0, 3), false],
  ] as const) {
    for (let turn = 0; turn < corners.length; ++turn) {
      const turned = [...corners.slice(turn), ...corners.slice(0, turn)];
      expect(crossesItself(turned)).toBe(crosses);
      expect(crossesItself([...turned].reverse())).toBe(crosses);
    }
  }
});

test("areas are shown on their storey: by height, or by its name", () => {
  const polygon = { case: "polygon" as const, value: { corners: square } };
  const rules = create(SiteRulesSchema, {
    regions: [
      { name: "everywhere", shape: polygon },
      { name: "above", shape: polygon, minZM: 2.9 },
      { name: "named", shape: polygon, storey: "shop", weight: 0 },
      { name: "box", shape: { case: "box", value: { min: { x: 0, y: 0, z: -3 }, max: { x: 1, y: 2, z: -0.2 } } } },
    ],
  });
  const names = new Map([["shop", 3]]);
  const shown = (floor: number, top: number) => areasOf(rules, { floor, top }, names).map((area) => area.label);
  expect(shown(0, 3)).toEqual(["everywhere"]);
  expect(shown(3, Infinity)).toEqual(["everywhere", "above", "named"]);
  expect(shown(-2.5, 0)).toEqual(["everywhere", "box"]);
  expect(areasOf(rules, { floor: 3, top: Infinity }, names)[2]!.out).toBe(true);
});
