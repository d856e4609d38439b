import 'image-gip/svelte';
import type { SvelteHTMLElements } from 'svelte/elements';

type Props = SvelteHTMLElements['gip-image'];
export const props: Props = { src: 'photo.gip', loading: 'lazy', class: 'wide', onincomplete: ({ error }) => console.log(error) };
// @ts-expect-error: there is no such value
export const wrong: Props = { loading: 'soon' };
