/** @jsxImportSource react */

import 'image-gip/react';

export const picture = (
  <gip-image
    src="photo.gip"
    alt="A lake"
    width={1200}
    height="800"
    loading="lazy"
    placeholder="x0dJUA=="
    className="wide"
    ref={(element) => void element?.decode()}
    onincomplete={({ error }) => console.log(error)}
  >
    <noscript />
  </gip-image>
);

// @ts-expect-error: there is no such value
export const wrong = <gip-image loading="soon" />;
