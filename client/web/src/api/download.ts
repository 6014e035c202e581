// Files that come out, as a download. They are held in memory, so what is larger is for a computer.
interface Piece {
  data: Uint8Array;
  fileName: string;
  totalSizeBytes: bigint;
}

// Receives a file piece by piece and gives it to the browser to keep. `progress` gets the share that is
// here, where the server knows how much comes.
export async function download(
  stream: AsyncIterable<Piece>,
  type: string,
  progress: (share: number) => void,
): Promise<void> {
  const pieces: BlobPart[] = [];
  let [came, file] = [0, "file"];
  for await (const piece of stream) {
    if (piece.fileName !== "") file = piece.fileName;
    if (piece.data.length === 0) continue;
    pieces.push(piece.data.slice());
    came += piece.data.length;
    if (piece.totalSizeBytes > 0n) progress(came / Number(piece.totalSizeBytes));
  }
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob(pieces, { type }));
  link.download = file;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
