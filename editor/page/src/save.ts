import type { Session } from "./session.svelte.ts";

/** Gives the person a file to keep. */
export function save(name: string, text: string, type: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type }));
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}

const name_of = (session: Session): string => (session.system || session.document!.file).replace(/.*\//, "").replace(/\.ya?ml$/, "");

export async function save_picture(session: Session): Promise<void> {
  save(`${name_of(session)}.svg`, (await session.picture()).svg, "image/svg+xml");
}

/** The drawing alone, instead of the page; browsers offer a PDF there, too. */
export async function print(session: Session): Promise<void> {
  const image = new Image(), title = document.title, name = name_of(session);
  image.className = "printed";
  image.alt = name;
  image.src = URL.createObjectURL(new Blob([(await session.picture()).svg], { type: "image/svg+xml" }));
  await image.decode();
  document.body.append(image);
  document.title = name; // which becomes the name of the PDF
  window.print();
  document.title = title;
  image.remove();
  URL.revokeObjectURL(image.src);
}
