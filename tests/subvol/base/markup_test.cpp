// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/markup.h"

#include <catch2/catch.hpp>

using subvol::internal::escaped_markup;

TEST_CASE("Text is escaped for markup and its attributes") {
  CHECK(escaped_markup("wall 1") == "wall 1");
  CHECK(escaped_markup("<a href=\"x\">R&D's</a>") == "&lt;a href=&quot;x&quot;&gt;R&amp;D&#39;s&lt;/a&gt;");
  CHECK(escaped_markup("a\tb\nc\x01"
                       "d\x1f") == "a\tb\nc d ");
  CHECK(escaped_markup("Stra\xc3\x9f"
                       "e") ==
        "Stra\xc3\x9f"
        "e");
}
