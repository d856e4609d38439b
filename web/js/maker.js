// Makes a .gip of a picture in this page, and what the browser's own formats make of as many bytes.

import { encode } from '../decoder/encoder.js';
import { arriving } from './file.js';
import { bytes, count, decimal, percent } from './format.js';
import { isCalm } from './motion.js';
import { ofBytes } from './rivals.js';

/** Bits per pixel of the slider's ends, and of the first file. */
const [LEAST, MOST, FIRST] = [0.02, 6, 0.5];
/** While the file is being made, smaller ones show how Gaussians are added: shares of its bytes. */
const STEPS = [1 / 16, 1 / 4];
/** The least bytes of such a file. */
const LEAST_STEP = 600;
/** How long the layers of the first file of a picture take to appear, in milliseconds. */
const ARRIVAL = 1200;

export class Maker {
  #section;
  #find;
  #onFile;
  #onRival;
  #onError;
  /** The picture that files are made of: `{ name, blob, bitmap, pixels }`; `null` for none. */
  #source = null;
  #file = null;
  /** Whether a file of this picture has been shown. */
  #isShown = false;
  #making = new AbortController();

  /**
   * `section` has the controls. `onFile` gets every file that is made, as `{ name, stream, isLast }`; `onRival` an
   * `ImageBitmap` to compare with, its name, and what to say of it.
   */
  constructor(section, { onFile, onRival, onError }) {
    this.#section = section;
    this.#find = (name) => section.querySelector(`[name="${name}"]`);
    this.#onFile = onFile;
    this.#onRival = onRival;
    this.#onError = onError;
    this.#find('bytes').addEventListener('input', () => this.#showSize());
    this.#find('bytes').addEventListener('change', () => void this.#make());
    this.#find('effort').addEventListener('change', () => void this.#make());
    this.#find('rival').addEventListener('change', () => void this.compare());
    this.#find('download').addEventListener('click', () => this.#download());
    this.#find('cancel').addEventListener('click', () => this.#making.abort());
  }

  /** Whether what is shown was made here. */
  get isOn() {
    return this.#source !== null;
  }

  /** Takes a picture in a format that the browser knows. Returns whether it is one. */
  async take(blob) {
    const bitmap = await createImageBitmap(blob).catch(() => null);
    if (!bitmap) return false;
    this.close();
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    const context = canvas.getContext('2d', { willReadFrequently: true });
    context.drawImage(bitmap, 0, 0);
    const pixels = context.getImageData(0, 0, bitmap.width, bitmap.height);
    this.#source = { name: blob.name.replace(/\.[^.]*$/, ''), blob, bitmap, canvas, pixels };
    this.#isShown = false;
    this.#section.hidden = false;
    this.#find('bytes').value = this.#positionOf(FIRST);
    this.#find('rival').value = 'original';
    void this.#make();
    return true;
  }

  /** Forgets the picture. */
  close() {
    this.#making.abort();
    this.#source?.bitmap.close();
    this.#source = this.#file = null;
    this.#section.hidden = true;
  }

  /** The slider is 0 to 1000, evenly in doublings. */
  #positionOf(bpp) {
    return Math.round((1000 * Math.log(bpp / LEAST)) / Math.log(MOST / LEAST));
  }

  /** The bytes that the slider stands for. */
  get #bytes() {
    const { width, height } = this.#source.pixels;
    const bpp = LEAST * (MOST / LEAST) ** (this.#find('bytes').value / 1000);
    return Math.max(200, Math.round((bpp * width * height) / 8));
  }

  #showSize() {
    const { width, height } = this.#source.pixels;
    const wanted = this.#bytes;
    const bpp = (8 * wanted) / (width * height);
    const text = `${bytes(wanted)}, ${bpp.toFixed(2)} bits per pixel`;
    this.#find('size').textContent = text;
    this.#find('bytes').setAttribute('aria-valuetext', text);
  }

  /** Makes the file that the controls ask for, and smaller ones before. */
  async #make() {
    this.#making.abort();
    this.#making = new AbortController();
    const { signal } = this.#making;
    const source = this.#source;
    const wanted = this.#bytes;
    this.#showSize();
    this.#file = null;
    this.#showWork(0);
    const steps = STEPS.map((share) => Math.round(share * wanted)).filter((size) => size >= LEAST_STEP);
    try {
      for (const size of [...steps, wanted]) {
        const isLast = size === wanted;
        const effort = isLast ? Number(this.#find('effort').value) : 1;
        const onprogress = ({ fraction, gaussians, psnr }) => {
          const found = gaussians > 0 ? `${count(gaussians, 'Gaussian')} · ${decimal(psnr, 1)} dB` : undefined;
          this.#showWork(isLast ? fraction : 0, found);
        };
        const { file } = await encode(source.pixels, { bytes: size, effort, signal, onprogress });
        signal.throwIfAborted();
        if (isLast) this.#file = file;
        const isSlow = isLast && !this.#isShown && !isCalm();
        const stream = isSlow ? arriving(file, ARRIVAL) : new Blob([file]).stream();
        await this.#onFile({ name: `${source.name}.gip`, stream, isLast });
        signal.throwIfAborted();
      }
      this.#isShown = true;
      await this.compare();
    } catch (error) {
      if (!signal.aborted) this.#onError(error);
    } finally {
      if (signal === this.#making.signal) this.#setWorking(false);
    }
  }

  /** Tells the share of the work that is done, and what there is so far. */
  #showWork(fraction, found = percent(fraction)) {
    this.#setWorking(true);
    this.#find('work').querySelector('progress').value = fraction;
    this.#find('work').querySelector('span').textContent = found;
  }

  #setWorking(isWorking) {
    this.#section.setAttribute('aria-busy', isWorking);
    this.#find('work').hidden = this.#find('cancel').hidden = !isWorking;
    this.#find('download').disabled = this.#file === null;
  }

  /** Puts what is chosen beside the file. */
  async compare() {
    const source = this.#source;
    const size = this.#file?.length;
    if (!source || !size) return;
    const kind = this.#find('rival').value;
    const rival = kind === 'original' ? { blob: source.blob, bytes: source.blob.size } : await ofBytes(source.canvas, kind, size);
    if (source !== this.#source || kind !== this.#find('rival').value) return;
    const { label } = this.#find('rival').selectedOptions[0];
    if (!rival) {
      this.#onRival(null, label, `This browser does not write ${label}; drop a file to compare with it.`);
      return;
    }
    const more = rival.isLarger ? ': it has none that is as small' : '';
    this.#onRival(await createImageBitmap(rival.blob), label, `${label}: ${bytes(rival.bytes)}; .gip: ${bytes(size)}${more}`);
  }

  #download() {
    const link = document.createElement('a');
    const url = URL.createObjectURL(new Blob([this.#file], { type: 'image/vnd.gip' }));
    Object.assign(link, { href: url, download: `${this.#source.name}.gip` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(url), 60_000);
  }
}
