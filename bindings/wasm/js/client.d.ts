/** Declares what the plug-in for Vite makes of imports: `/// <reference types="image-gip/client" />`. */

declare module '*?gip' {
  const picture: import('./vite.js').ImportedPicture;
  export default picture;
}
