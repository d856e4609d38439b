/** @jsxImportSource preact */

import 'image-gip/preact';

export const picture = (
  <gip-image src="photo.gip" alt="A lake" width={1200} loading="lazy" class="wide" onincomplete={({ error }) => console.log(error)} />
);

// @ts-expect-error: there is no such value
export const wrong = <gip-image texture="strong" />;
