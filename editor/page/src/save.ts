import type { Session } from "./session.svelte.ts";

/** Gives the person a file to keep. */
export function save(name: string, text: string, type: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type }));
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}

export async function save_picture(session: Session): Promise<void> {
  const { name, text } = await session.picture();
  save(name, text, "image/svg+xml");
}

/** The drawing alone, instead of the page; browsers offer a PDF there, too. */
export async function print(session: Session): Promise<void> {
  const image = new Image(), title = document.title, { name, text } = await session.picture();
  image.className = "printed";
  image.alt = name.replace(/\.svg$/, "");
  image.src = URL.createObjectURL(new Blob([text], { type: "image/svg+xml" }));
  await image.decode();
  document.body.append(image);
  document.title = image.alt; // which becomes the name of the PDF
  window.print();
  document.title = title;
  image.remove();
  URL.revokeObjectURL(image.src);
}
