/** @jsxImportSource vue */

import 'image-gip/vue';
import type { GlobalComponents } from 'vue';

export const picture = <gip-image src="photo.gip" alt="A lake" width={1200} class="wide" onIncomplete={({ error }) => console.log(error)} />;

type Props = InstanceType<GlobalComponents['gip-image']>['$props'];
export const props: Props = { src: 'photo.gip', loading: 'lazy' };
// @ts-expect-error: there is no such value
export const wrong: Props = { loading: 'soon' };
