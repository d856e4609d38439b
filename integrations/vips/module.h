/* SPDX-License-Identifier: MIT OR Apache-2.0 */
#pragma once

void gip_module_load_types(void);
void gip_module_save_types(void);
