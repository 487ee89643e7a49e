interface Committed {
  text: string; // that the document has
  /** False where it is refused. */
  set(wanted: string): Promise<boolean> | undefined;
}

/**
 * A field of the document: Enter (in several lines with Ctrl) and leaving it set what was typed, Escape takes it back. What
 * was refused is not asked for again by leaving.
 */
export function committed(field: HTMLInputElement | HTMLTextAreaElement, given: Committed) {
  let now = given, refused: string | null = null;
  const commit = async () => {
    const wanted = field.value, before = now;
    if (wanted === before.text) return;
    refused = wanted; // until it is taken
    if (!(await before.set(wanted))) return;
    refused = null;
    if (now === before) now = { ...before, text: wanted }; // a field that goes now is not asked again
  };
  const back = () => {
    field.value = now.text;
    field.dispatchEvent(new Event("input", { bubbles: true }));
  };
  const key = (event: Event) => {
    const { key, ctrlKey } = event as KeyboardEvent;
    if (key === "Escape") back();
    else if (key === "Enter" && (ctrlKey || field instanceof HTMLInputElement)) void commit();
    else return;
    event.preventDefault();
  };
  // A field that goes while it has the keyboard is left, too: what was typed into it is on its way then.
  const leave = () => (field.value === refused ? queueMicrotask(() => field.isConnected && back()) : void commit());
  field.addEventListener("keydown", key);
  field.addEventListener("blur", leave);
  return {
    update: (next: Committed) => void (now = next),
    destroy() {
      field.removeEventListener("keydown", key);
      field.removeEventListener("blur", leave);
    },
  };
}
