// Instruments whose figures the server knows (ScannerModel.preset), with their settings, the usual one
// first. The contract has no call that lists them; tests/browser opens a job with each.
export interface Preset {
  id: string;
  name: string;
  settings: readonly string[];
}

export const presets: readonly Preset[] = [
  { id: "faro-focus", name: "FARO Focus S 150", settings: ["1/4", "1/2", "1/5", "1/8"] },
  { id: "leica-blk360", name: "Leica BLK360", settings: ["medium", "high", "low"] },
  { id: "leica-rtc360", name: "Leica RTC360", settings: ["6mm", "3mm", "12mm"] },
  { id: "riegl-vz-400i", name: "RIEGL VZ-400i", settings: ["panorama-40", "panorama-20", "panorama-60"] },
  { id: "trimble-x7", name: "Trimble X7", settings: ["11mm", "5mm", "4mm"] },
  { id: "trimble-x9", name: "Trimble X9", settings: ["11mm", "5mm", "4mm"] },
];
