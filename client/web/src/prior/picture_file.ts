// A picture of a floor plan as it is sent: a PNG that the server takes, whatever the tablet's camera or gallery had.
import { mostPriorBytes } from "./prior_kind";
import type { GreyPicture } from "./picture_outlines";

// As fine as a plan needs; pictures of larger ones are made smaller, pixels.
const mostPixels = 6e6;

export interface PlanPicture {
  // A PNG.
  bytes: Uint8Array<ArrayBuffer>;
  picture: GreyPicture;
}

// An error where the browser cannot read it. Undefined: it does not become small enough.
export async function planPicture(file: Blob): Promise<PlanPicture | undefined> {
  const image = await createImageBitmap(file);
  const head = new Uint8Array(await file.slice(0, 4).arrayBuffer());
  const isPng = head[0] === 0x89 && head[1] === 0x50;
  const pixels = image.width * image.height;
  let scale = Math.min(1, Math.sqrt(mostPixels / pixels));
  try {
    // Each time half of the pixels, until it fits.
    for (let tries = 0; tries < 8; ++tries, scale /= Math.SQRT2) {
      const canvas = document.createElement("canvas");
      canvas.width = Math.max(1, Math.round(scale * image.width));
      canvas.height = Math.max(1, Math.round(scale * image.height));
      const context = canvas.getContext("2d", { willReadFrequently: true });
      if (context === null) throw new Error("no canvas");
      // What is transparent is paper.
      context.fillStyle = "#ffffff";
      context.fillRect(0, 0, canvas.width, canvas.height);
      context.imageSmoothingQuality = "high";
      context.drawImage(image, 0, 0, canvas.width, canvas.height);
      const picture = grey(context.getImageData(0, 0, canvas.width, canvas.height));
      if (isPng && scale === 1 && file.size <= mostPriorBytes) {
        return { bytes: new Uint8Array(await file.arrayBuffer()), picture };
      }
      const png = await new Promise<Blob | null>((resolve) => canvas.toBlob(resolve, "image/png"));
      if (png === null) throw new Error("no PNG");
      if (png.size <= mostPriorBytes) return { bytes: new Uint8Array(await png.arrayBuffer()), picture };
    }
  } finally {
    image.close();
  }
  return undefined;
}

function grey(image: ImageData): GreyPicture {
  const { width, height, data } = image;
  const values = new Uint8Array(width * height);
  for (let i = 0; i < values.length; ++i) {
    values[i] = 0.2126 * data[4 * i]! + 0.7152 * data[4 * i + 1]! + 0.0722 * data[4 * i + 2]!;
  }
  return { width, height, grey: values };
}
