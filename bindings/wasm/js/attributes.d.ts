// The attributes of `<gip-image>` in templates, for the declarations of the frameworks.

export interface GipImageAttributes {
  src?: string;
  alt?: string;
  width?: number | string;
  height?: number | string;
  loading?: 'eager' | 'lazy';
  crossorigin?: '' | 'anonymous' | 'use-credentials';
  referrerpolicy?: string;
  fetchpriority?: 'auto' | 'high' | 'low';
  /** A small `.gip`, or the first bytes of the file, in base64 or as a `data:` URL. */
  placeholder?: string;
  texture?: 'on' | 'off';
  detail?: 'auto' | 'full';
}

/** The listeners, as React and Preact take those of custom elements. */
export interface GipImageListeners {
  onload?: (event: Event) => void;
  onerror?: (event: ErrorEvent) => void;
  onincomplete?: (event: ErrorEvent) => void;
  onprogress?: (event: ProgressEvent) => void;
}
