/* SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * The entry of the module: makes its operations known to libvips. */
#include "module.h"

#include <gmodule.h>

G_MODULE_EXPORT const gchar *g_module_check_init(GModule *module)
{
    gip_module_load_types();
    gip_module_save_types();
    /* Types remain for ever, so their code has to. */
    g_module_make_resident(module);
    return NULL;
}
