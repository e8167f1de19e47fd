// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace subvol::cli {

// Parts of pages that load nothing and run nothing, in one style, light or dark as the reader prefers. Texts are HTML
// unless they are said to be plain.

/// The page up to its body; the title is plain text.
std::string page_begin(const std::string& title);
/// The end of the page, with the version of subvol, which is plain text.
std::string page_end(const std::string& version);

/// Six digits.
std::string number(double value);

std::string row(std::initializer_list<std::string> cells);
/// A table of rows that `row` has made.
std::string table(std::initializer_list<const char*> heads, const std::string& rows);
/// A heading and what follows it; empty without a body.
std::string section(const char* title, const std::string& body);

/// A picture as data, with a caption. title: plain text for those who cannot see it. png: the file's bytes.
std::string picture_figure(const std::string& title, std::string_view png, const std::string& caption);

}  // namespace subvol::cli
