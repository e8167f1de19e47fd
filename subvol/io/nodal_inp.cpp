// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/inp_content.h"
#include "subvol/io/inp_lines.h"
#include "subvol/io/inp_sets.h"
#include "subvol/io/mesh_formats.h"
#include "subvol/io/nodal_formats.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

constexpr InpType kInpTypes[] = {
    {4, CellKind::tet, 1},  {5, CellKind::pyramid, 1}, {6, CellKind::prism, 1}, {8, CellKind::hex, 1},
    {10, CellKind::tet, 2}, {15, CellKind::prism, 2},  {20, CellKind::hex, 2},  {27, CellKind::hex, 2},
};
constexpr const char* kSolidFamilies[] = {"C3D", "DC3D",  "AC3D", "DCC3D", "F3D", "EC3D",
                                          "Q3D", "EMC3D", "SC",   "CSS"};  // the last two: shells that are solids
constexpr const char* kShellFamilies[] = {"STRI", "S", "M3D", "R3D", "SFM3D", "DS"};

class InpParser {
 public:
  InpParser(const std::string& name, std::string_view bytes) : lines_of_file_(name, bytes) {}

  NodalMesh parse() {
    lines_of_file_.visit([this](const InpLine& line) {
      line_ = &line;
      place_ = line.place;
      line.is_data() ? read_data() : open_keyword();
    });
    place_ = lines_of_file_.place();
    if (element_open_) fail("the file ends within an element");
    content_.left_out.add("parts without an instance", lines_of_file_.unused_parts());
    content_.element_sets.close(place_);
    content_.node_sets.close(place_);
    return mesh_of_inp(content_);
  }

 private:
  static constexpr std::size_t kNoElementSet = InpSets::kNoInpSet;

  [[noreturn]] void fail(const std::string& what) const { fail_at(place_, what); }

  void open_keyword() {
    if (element_open_) fail("a keyword within an element: expected more nodes");
    const std::string& keyword = line_->keyword;
    if (keyword == "NODE")
      open_nodes();
    else if (keyword == "ELEMENT")
      open_elements();
    else if (keyword == "NSET" || keyword == "ELSET")
      open_set();
    else if (keyword == "SURFACE")
      open_surface();
    else if (keyword == "SOLID SECTION")
      content_.sections.push_back(content_.element_sets.named(line_->parameter("ELSET"), line_->instance));
    else if (keyword == "SYSTEM" || keyword == "NCOPY" || keyword == "NGEN" || keyword == "ELGEN" ||
             keyword == "NFILL" || keyword == "ELCOPY" || keyword == "NMAP")
      fail("*" + keyword + " is not read: write the nodes and elements themselves");
    else
      content_.left_out.add("keywords *" + keyword);
  }

  void read_data() {
    const std::string& keyword = line_->keyword;
    const std::vector<std::string>& fields = line_->fields;
    if (keyword == "NODE")
      read_node(fields);
    else if (keyword == "ELEMENT")
      read_element(fields);
    else if (keyword == "NSET" || keyword == "ELSET")
      read_set(fields);
    else if (keyword == "SURFACE")
      read_surface(fields);
  }

  std::int64_t positive(const std::string& text, const char* what) const {
    const auto value = parse_integer(text);
    if (!value || *value <= 0)
      fail(std::string("expected ") + what + " (a positive whole number), found " + in_quotes(text));
    if (*value >= kInpNumbers) fail(std::string("expected ") + what + " below " + std::to_string(kInpNumbers));
    return *value;
  }
  /// The number of a node or an element of an instance; null: the assembly.
  std::int64_t label(const std::string& text, const char* what, const InpInstance* instance) const {
    return positive(text, what) + (instance ? instance->first : 0);
  }
  std::int64_t label(const std::string& text, const char* what) const { return label(text, what, line_->instance); }

  // --- Nodes and elements --------------------------------------------------------------------------------------------

  void open_nodes() {
    if (const std::string system = line_->parameter("SYSTEM"); !system.empty() && upper_case(system) != "R")
      fail("*NODE, SYSTEM=" + system + ": expected rectangular coordinates");
  }

  void read_node(const std::vector<std::string>& fields) {
    const std::int64_t number = label(fields[0], "the number of a node");
    Vec3 p = Vec3::Zero();
    for (std::size_t k = 1; k < fields.size() && k < 4; ++k) {
      if (fields[k].empty()) continue;
      std::string text = fields[k];
      std::replace_if(
          text.begin(), text.end(), [](char c) { return c == 'd' || c == 'D'; }, 'e');
      const auto value = parse_number(text);
      if (!value) fail("expected a coordinate (a finite number), found " + in_quotes(fields[k]));
      p[static_cast<Eigen::Index>(k - 1)] = *value;
    }
    if (line_->instance) p = line_->instance->rotation * p + line_->instance->shift;
    const auto [known, is_new] = content_.nodes.try_emplace(number, static_cast<Index>(content_.positions.size()));
    if (is_new)
      content_.positions.push_back(p);
    else
      content_.positions[known->second] = p;  // a later definition replaces an earlier one
  }

  void open_elements() {
    const std::string type = upper_case(line_->parameter("TYPE"));
    if (type.empty()) fail("*ELEMENT: expected TYPE=");
    type_ = nullptr;
    shell_corners_ = 0;
    for (const std::string_view family : kShellFamilies)
      if (const auto digits = digits_after(type, family); digits && shell_corners_ == 0)
        shell_corners_ = *digits == 3 || *digits == 6 || *digits == 65 ? 3 : *digits == 4 || *digits == 8 ? 4 : 0;
    for (const std::string_view family : kSolidFamilies) {
      if (!type.starts_with(family)) continue;
      const auto digits = digits_after(type, family);
      if (!digits) continue;
      if (*digits == 13) fail(std::string("a curved pyramid: ") + kNoCurvedPyramids);
      const auto found = std::find_if(std::begin(kInpTypes), std::end(kInpTypes),
                                      [&](const InpType& t) { return t.digits == *digits; });
      if (found == std::end(kInpTypes))
        fail("elements of type " + in_quotes(type) + " are not read, expected C3D4, 5, 6, 8, 10, 15, 20 or 27");
      type_ = found;
    }
    set_ =
        line_->has("ELSET") ? content_.element_sets.defined(line_->parameter("ELSET"), line_->instance) : kNoElementSet;
    skipped_type_ = type;
  }

  /// The number that a type has behind the letters of its family.
  static std::optional<std::int64_t> digits_after(std::string_view type, std::string_view family) {
    if (!type.starts_with(family)) return std::nullopt;
    std::size_t end = family.size();
    while (end < type.size() && type[end] >= '0' && type[end] <= '9') ++end;
    return parse_integer(type.substr(family.size(), end - family.size()));
  }

  void read_shell(const std::vector<std::string>& fields) {
    if (fields.size() <= shell_corners_) fail("fewer nodes than an element of its type has");
    for (std::size_t i = 1; i <= shell_corners_; ++i)
      content_.shell_nodes.push_back(label(fields[i], "the number of a node"));
    content_.shells.push_back({content_.shell_nodes.size(), set_, place_});
  }

  void read_element(const std::vector<std::string>& fields) {
    if (!type_) {
      ++(shell_corners_ > 0 ? content_.num_shells : content_.num_skipped)[skipped_type_];
      if (shell_corners_ > 0) read_shell(fields);
      return;
    }
    std::size_t at = 0;
    if (!element_open_) {
      const std::int64_t number = label(fields[at++], "the number of an element");
      if (!content_.elements_by_label.try_emplace(number, static_cast<Index>(content_.elements.size())).second)
        fail("a second element " + std::to_string(number % kInpNumbers));
      if (set_ != kNoElementSet) content_.element_sets.add_range(set_, number, number, 1, place_);
      content_.elements.push_back(
          {type_, content_.element_nodes.size(), static_cast<std::size_t>(type_->digits), set_, place_});
      element_open_ = true;
    }
    const std::size_t end = content_.elements.back().first_node + content_.elements.back().num_nodes;
    for (; at < fields.size(); ++at) {
      if (content_.element_nodes.size() == end) fail("more nodes than an element of its type has");
      content_.element_nodes.push_back(label(fields[at], "the number of a node"));
    }
    element_open_ = content_.element_nodes.size() < end;
  }

  // --- Sets ----------------------------------------------------------------------------------------------------------

  /// The instance whose sets and numbers a line of a set or a surface names.
  const InpInstance* instance_of_set() const {
    if (line_->instance || !line_->has("INSTANCE")) return line_->instance;
    const InpInstance* instance = lines_of_file_.instance(line_->parameter("INSTANCE"));
    // A file without parts may name instances that it was made of.
    if (!instance && lines_of_file_.has_parts())
      fail("there is no instance " + in_quotes(line_->parameter("INSTANCE")));
    return instance;
  }

  void open_set() {
    const std::string name = line_->parameter(line_->keyword.c_str());
    if (name.empty()) fail("*" + line_->keyword + ": expected a name");
    sets_ = line_->keyword == "NSET" ? &content_.node_sets : &content_.element_sets;
    set_ = sets_->defined(name, line_->instance);
    from_element_set_ = sets_ == &content_.node_sets && line_->has("ELSET");
    if (from_element_set_) content_.left_out.add("node sets of element sets");
  }

  void read_set(const std::vector<std::string>& fields) {
    if (from_element_set_) return;
    const InpInstance* instance = instance_of_set();
    if (line_->has("GENERATE")) {
      if (fields.size() < 2) fail("GENERATE: expected a first and a last number");
      const std::int64_t first = label(fields[0], "the first number", instance),
                         last = label(fields[1], "the last number", instance);
      sets_->add_range(set_, first, last, fields.size() > 2 ? positive(fields[2], "the step") : 1, place_);
      return;
    }
    for (const std::string& field : fields) {
      if (field.empty()) continue;
      const auto [own, rest] = split(field, instance);
      if (parse_integer(rest)) {
        const std::int64_t number = label(rest, "the number of a member", own);
        sets_->add_range(set_, number, number, 1, place_);
      } else {
        sets_->add_set(set_, sets_->named(rest, own), place_);
      }
    }
  }

  /// Splits INSTANCE.NUMBER and INSTANCE.SET. Returns the instance, and what is behind its name.
  std::pair<const InpInstance*, std::string> split(const std::string& field, const InpInstance* otherwise) const {
    for (std::size_t dot = field.rfind('.'); dot != std::string::npos && dot > 0; dot = field.rfind('.', dot - 1))
      if (const InpInstance* instance = lines_of_file_.instance(field.substr(0, dot)))
        return {instance, field.substr(dot + 1)};
    return {otherwise, field};
  }

  void open_surface() {
    const std::string type = upper_case(line_->parameter("TYPE"));
    surface_ = kNoIndex;
    if (!type.empty() && type != "ELEMENT") {
      content_.left_out.add("surfaces of nodes");
      return;
    }
    const std::string name = line_->parameter("NAME");
    const std::optional<int> number = inp_number(name, "GROUP_");
    const bool is_inside = line_->instance && !line_->instance->name.empty();
    surface_ = number ? content_.faces.by_number(*number)
                      : content_.faces.by_name(is_inside ? line_->instance->name + "." + name : name);
    if (is_inside && !number) content_.plain_names[surface_] = name;
  }

  void read_surface(const std::vector<std::string>& fields) {
    if (surface_ == kNoIndex) return;
    const std::string side = fields.size() > 1 ? upper_case(fields[1]) : "";
    const auto number =
        side.size() == 2 && side[0] == 'S' ? parse_integer(std::string_view(side).substr(1)) : std::nullopt;
    if (!number) {
      content_.left_out.add("lines of surfaces without a face S1 to S6");
      return;
    }
    const auto [instance, rest] = split(fields[0], instance_of_set());
    const bool is_element = parse_integer(rest).has_value();
    content_.sides.push_back({is_element ? label(rest, "the number of an element", instance) : 0,
                              is_element ? kNoElementSet : content_.element_sets.named(rest, instance),
                              static_cast<int>(*number), surface_, place_});
  }

  InpLines lines_of_file_;
  const InpLine* line_ = nullptr;
  FilePlace place_;  ///< of what is read, for messages
  InpContent content_;
  std::size_t shell_corners_ = 0;  ///< of the elements being read; 0: no shells
  const InpType* type_ = nullptr;
  std::string skipped_type_;
  InpSets* sets_ = nullptr;  ///< of the set that is being read
  std::size_t set_ = kNoElementSet;
  Index surface_ = kNoIndex;
  bool element_open_ = false, from_element_set_ = false;
};

}  // namespace

NodalMesh parse_inp(const std::string& name, std::string_view bytes, const std::string&) {
  return InpParser(name, bytes).parse();
}

}  // namespace subvol::internal
