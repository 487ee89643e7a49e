/** Images that a drawing names. */
export class Images {
  private readonly known = new Map<string, HTMLImageElement | null>();
  private drawn = $state(0);
  private readonly data: (path: string) => Promise<ArrayBuffer>;

  constructor(data: (path: string) => Promise<ArrayBuffer>) { this.data = data; }

  /** Null: it comes. It is shown as by <img>, which runs nothing that stands in it. */
  readonly of = (address: string): HTMLImageElement | null => {
    void this.drawn;
    const known = this.known.get(address);
    if (known === undefined) {
      this.known.set(address, null);
      void this.data(address).then(async (bytes) => {
        const image = new Image(), url = URL.createObjectURL(new Blob([bytes], { type: address.endsWith(".png") ? "image/png" : "image/svg+xml" }));
        image.src = url;
        await image.decode();
        this.known.set(address, image);
        ++this.drawn;
      }).catch(() => {}); // it is gone, or holds no image after all: its place stays empty
    }
    return known ?? null;
  };
}
