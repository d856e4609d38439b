/** Makes `.gip` work wherever the browser shows a picture, on sites whose markup cannot change. */

/**
 * Installs the service worker, and has the `.gip` pictures that the page could not show fetched once more. From the next
 * visit on they are there at once.
 *
 * `script` is the address of `service-worker.js` of this package, which must be on the page's own origin, at or above the
 * pages that it is for. Rejects with an `Error` where there are no service workers, or it is not for this
 * page, and as `register` of the browser does.
 */
export function install(
  script?: string | URL,
  options?: {
    /** The pages that it is for; by default those in the folder of the script. */
    scope?: string;
    /** The address of `image_gip_bg.wasm`; by default it is beside this script. */
    wasm?: string | URL;
  },
): Promise<ServiceWorkerRegistration>;
