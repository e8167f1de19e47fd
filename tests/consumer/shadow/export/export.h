// SPDX-License-Identifier: GPL-3.0-or-later
#error "a header of the library was looked for in a folder of the user"
