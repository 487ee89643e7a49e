/** What outlives a page: `localStorage` of its address, `sessionStorage` of its tab. A browser that stores nothing forgets it. */
export function kept<T>(store: "localStorage" | "sessionStorage", name: string): T | null {
  try {
    const text = window[store].getItem(name);
    return text === null ? null : (JSON.parse(text) as T);
  } catch {
    return null;
  }
}
/** Null forgets it. */
export function keep(store: "localStorage" | "sessionStorage", name: string, value: unknown): void {
  try {
    if (value === null) window[store].removeItem(name);
    else window[store].setItem(name, JSON.stringify(value));
  } catch { /* it is full, or there is none */ }
}
