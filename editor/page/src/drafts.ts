import { keep, kept } from "./kept.ts";

/** What was typed, and what the file held that it was typed into. */
export interface Draft { base: string; text: string }

/** Text that was typed and stands in no file, by file: it outlives the page, and the browser. */
export class Drafts {
  private readonly own = new Map<string, Draft>(); // of this page
  private name_of(file: string): string { return `draft ${location.pathname} ${file}`; }

  get(file: string): (Draft & { is_own: boolean }) | null {
    const own = this.own.get(file), draft = own ?? kept<Draft>("localStorage", this.name_of(file));
    return draft && typeof draft.base === "string" && typeof draft.text === "string" ? { ...draft, is_own: own !== undefined } : null;
  }
  set(file: string, draft: Draft | null): void {
    if (draft) this.own.set(file, draft);
    else this.own.delete(file);
    keep("localStorage", this.name_of(file), draft);
  }
  /** Of this page. */
  get are_there(): boolean { return this.own.size > 0; }
}
