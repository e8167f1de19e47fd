// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/reference_arrays.h"

#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/left_out.h"

#include <algorithm>
#include <iterator>

namespace subvol::internal {

namespace {

/// Names of references as `plain` returns them, in order of preference.
constexpr std::string_view kReferenceNames[] = {
    "reference",      "ref",          "meditref",       "material",     "materialid",  "mat",      "matid",
    "attribute",      "gmshphysical", "physical",       "cellentityid", "region",      "regionid", "subdomain",
    "subdomainid",    "domain",       "domainid",       "zone",         "zoneid",      "block",    "blockid",
    "elementblockid", "part",         "partid",         "component",    "componentid", "label",    "tag",
    "celltag",        "marker",       "gmshgeometrical"};

/// Names, as `plain` returns them, of arrays that only number cells or processes.
constexpr std::string_view kIdNames[] = {
    "id",        "cellid",    "elementid",    "elemid",      "cellnumber", "elementnumber", "index",
    "cellindex", "processid", "vtkprocessid", "processorid", "rank",       "procid"};

/// Returns a name's letters, in lower case, and digits, without a plural's s.
std::string plain(std::string_view name) {
  std::string text;
  for (const char c : lower_case(name))
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) text += c;
  if (text.size() > 2 && text.ends_with('s')) text.pop_back();
  return text;
}

bool is_id_or_ghost(std::string_view name) {
  const std::string text = plain(name);
  const bool is_id = text.ends_with("id") || text.ends_with("number") || text.ends_with("index");
  return text.find("ghost") != std::string::npos ||
         (is_id &&
          (text.starts_with("global") || text.starts_with("pedigree") || text.find("original") != std::string::npos)) ||
         std::find(std::begin(kIdNames), std::end(kIdNames), text) != std::end(kIdNames);
}

std::size_t rank(const CellNumbers& array) {
  return reference_name_rank(array.name).value_or(std::size(kReferenceNames));
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text.append(text.empty() ? "" : ", ").append(in_quotes(name));
  return text;
}

}  // namespace

std::optional<std::size_t> reference_name_rank(std::string_view name) {
  const auto* found = std::find(std::begin(kReferenceNames), std::end(kReferenceNames), plain(name));
  if (found == std::end(kReferenceNames)) return std::nullopt;
  return static_cast<std::size_t>(found - std::begin(kReferenceNames));
}

bool may_be_references(const CellNumbers& array) {
  return !is_id_or_ghost(array.name) && (!array.is_real || rank(array) < std::size(kReferenceNames));
}

std::optional<std::size_t> choose_references(const std::vector<CellNumbers>& arrays, const std::string& name,
                                             const std::vector<std::string>& others) {
  if (name.empty()) {
    std::optional<std::size_t> chosen;
    for (std::size_t i = 0; i < arrays.size(); ++i)
      if (may_be_references(arrays[i]) && (!chosen || rank(arrays[i]) < rank(arrays[*chosen]))) chosen = i;
    return chosen;
  }
  const auto is_named = [&](const CellNumbers& array) { return array.name == name; };
  const auto is_like = [&](const CellNumbers& array) { return lower_case(array.name) == lower_case(name); };
  auto found = std::find_if(arrays.begin(), arrays.end(), is_named);
  if (found == arrays.end()) found = std::find_if(arrays.begin(), arrays.end(), is_like);
  if (found != arrays.end()) return static_cast<std::size_t>(found - arrays.begin());
  std::vector<std::string> names;
  for (const CellNumbers& array : arrays) names.push_back(array.name);
  throw InputError("no cell data " + in_quotes(name) + " of whole numbers to take references from; there are " +
                   (names.empty() ? "none" : listed(names)) +
                   (others.empty() ? "" : ", and these of fractions or of several components: " + listed(others)));
}

void tell_of_references(const std::vector<CellNumbers>& arrays, std::optional<std::size_t> chosen, bool was_asked,
                        std::size_t num_arrays, std::vector<std::string>& warnings) {
  // An array may stand in a file twice, under two names.
  const auto is_chosen = [&](const CellNumbers& array) { return chosen && array.values == arrays[*chosen].values; };
  const auto num_chosen = std::count_if(arrays.begin(), arrays.end(), is_chosen);
  LeftOut left_out;
  left_out.add("data arrays", num_arrays - static_cast<std::size_t>(num_chosen));
  left_out.tell(warnings);
  if (!chosen || was_asked) return;
  const auto rivals = std::count_if(arrays.begin(), arrays.end(), [&](const CellNumbers& array) {
    return may_be_references(array) && !is_chosen(array);
  });
  if (rivals > 0)
    warnings.push_back("references are taken from the cell data " + in_quotes(arrays[*chosen].name) + "; there are " +
                       std::to_string(rivals) + " more of whole numbers, of which --references NAME chooses another");
}

}  // namespace subvol::internal
