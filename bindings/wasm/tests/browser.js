// Debian's Chromium, or the browser that the variable CHROMIUM names.

import { existsSync } from 'node:fs';
import { chromium } from 'playwright-core';

const executablePath = process.env.CHROMIUM ?? '/usr/bin/chromium';

/** Why there is no browser; `false` if there is one. */
export const missing = existsSync(executablePath) ? false : `there is no ${executablePath}`;

export function launch(...args) {
  return chromium.launch({
    executablePath,
    args: [
      '--no-sandbox',
      '--disable-gpu',
      '--disable-quic',
      '--no-first-run',
      '--disable-background-networking',
      '--disable-component-update',
      '--disable-sync',
      // `measureUserAgentSpecificMemory` answers at once.
      '--enable-blink-features=ForceEagerMeasureMemory',
      ...args,
    ],
  });
}
