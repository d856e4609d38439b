'use client';

// The element's script is also run on the server, where there are no elements.
import 'image-gip/element';
import { useEffect } from 'react';

export function Picture() {
  useEffect(() => {
    import('../main.js');
  }, []);
  return <gip-image width="20" height="10" alt="From the server"></gip-image>;
}
