// The scalar types of PLY files, by both of their names.
const sizes: Record<string, number> = {
  char: 1,
  uchar: 1,
  int8: 1,
  uint8: 1,
  short: 2,
  ushort: 2,
  int16: 2,
  uint16: 2,
  int: 4,
  uint: 4,
  int32: 4,
  uint32: 4,
  float: 4,
  float32: 4,
  double: 8,
  float64: 8,
};

// An error where there is no such type.
export function bytesOf(type: string): number {
  const size = sizes[type];
  if (size === undefined) throw new Error(`a property of type '${type}'`);
  return size;
}

export function readScalar(view: DataView, at: number, type: string, little: boolean): number {
  switch (type) {
    case "char":
    case "int8":
      return view.getInt8(at);
    case "uchar":
    case "uint8":
      return view.getUint8(at);
    case "short":
    case "int16":
      return view.getInt16(at, little);
    case "ushort":
    case "uint16":
      return view.getUint16(at, little);
    case "int":
    case "int32":
      return view.getInt32(at, little);
    case "uint":
    case "uint32":
      return view.getUint32(at, little);
    case "float":
    case "float32":
      return view.getFloat32(at, little);
    default:
      return view.getFloat64(at, little);
  }
}
