/** <maille-viewer>: importing this module defines the element. docs/viewer.md has its attributes. */
export class MailleViewer extends HTMLElement {
  /** Shows another mesh; resolves to whether it could be opened. */
  open(input: string | Blob | ArrayBuffer): Promise<boolean>;
  /** Shows all of it again. */
  fit(): void;
  /** A picture of what is seen. */
  toBlob(type?: string): Promise<Blob | null>;
  /** Is all there that this view needs? */
  readonly settled: boolean;
}
declare global {
  interface HTMLElementTagNameMap {
    'maille-viewer': MailleViewer;
  }
}
