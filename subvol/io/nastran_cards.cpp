// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/nastran_cards.h"

#include "subvol/base/text_scanner.h"

#include <algorithm>

namespace subvol::internal {

namespace {

constexpr std::size_t kLongestPath = 4096;  ///< of an included file, in bytes

/// Replaces tabs by blanks up to the next column of eight.
std::string without_tabs(std::string_view line) {
  std::string result;
  for (const char c : line) {
    if (c != '\t')
      result += c;
    else
      result.append(8 - result.size() % 8, ' ');
  }
  return result;
}

/// The name and the data of a line: eight of them, or four of a line of large fields. A field for continuations at
/// the end of a line is dropped.
std::vector<std::string> fields_of_card(const std::string& line) {
  std::vector<std::string> fields;
  if (line.find(',') != std::string::npos) {
    std::size_t at = 0;
    while (at <= line.size()) {
      const std::size_t end = std::min(line.find(',', at), line.size());
      fields.push_back(trimmed(std::string_view(line).substr(at, end - at)));
      at = end + 1;
    }
    const std::size_t most = fields[0].find('*') == std::string::npos ? 9 : 5;
    fields.resize(most);
    return fields;
  }
  fields.push_back(trimmed(std::string_view(line).substr(0, 8)));
  const bool is_large = fields[0].find('*') != std::string::npos;
  const std::size_t width = is_large ? 16 : 8, count = is_large ? 4 : 8;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t begin = 8 + i * width;
    fields.push_back(begin < line.size() ? trimmed(std::string_view(line).substr(begin, width)) : std::string());
  }
  return fields;
}

/// The mark by which a line in fixed fields names its continuation (columns 73 to 80), or a continuation itself
/// (columns 1 to 8), without the '+' or '*' that only some programs write. Empty: none, or a line in free fields.
std::string mark_at(const std::string& line, std::size_t column) {
  if (line.find(',') != std::string::npos || line.size() <= column) return {};
  const std::string mark = trimmed(std::string_view(line).substr(column, 8));
  return !mark.empty() && (mark[0] == '+' || mark[0] == '*') ? trimmed(std::string_view(mark).substr(1)) : mark;
}

/// Returns what follows INCLUDE in such a line, or nothing.
std::optional<std::string> included_in(std::string_view line) {
  constexpr std::string_view kWord = "include";
  const std::string text = trimmed(line);
  if (text.size() <= kWord.size() || lower_case(text.substr(0, kWord.size())) != kWord) return std::nullopt;
  const char next = text[kWord.size()];
  if (next != ' ' && next != '\t' && next != '\'' && next != '"') return std::nullopt;
  return trimmed(std::string_view(text).substr(kWord.size()));
}

/// Returns x of "*x" or "*(x)", by which a field of a repeated card grows; nothing if the field is no such.
std::optional<std::string> step_of(std::string_view field) {
  if (field.size() < 2 || field[0] != '*') return std::nullopt;
  field.remove_prefix(1);
  if (field.size() > 2 && field.front() == '(' && field.back() == ')') field = field.substr(1, field.size() - 2);
  return trimmed(field);
}

/// The sum of two fields, as whole numbers if both are; `field` as it is if one of them is no number.
std::string added(const std::string& field, const std::string& step) {
  const auto whole = parse_integer(field), whole_step = parse_integer(step);
  std::int64_t whole_sum = 0;
  if (whole && whole_step && !__builtin_add_overflow(*whole, *whole_step, &whole_sum)) return std::to_string(whole_sum);
  const auto number = field.empty() ? 0.0 : nastran_number(field), number_step = nastran_number(step);
  if (!number || !number_step) return field;
  std::string sum;
  append_number(sum, *number + *number_step);
  return sum;
}

/// Throws InputError if a card is longer than any that a program repeats: each repetition would copy all of it.
void require_short(const NastranCard& card) {
  constexpr std::size_t kMostFields = 65, kMostCharacters = 2000;
  std::size_t characters = 0;
  for (const std::string& field : card.fields) characters += field.size();
  if (card.fields.size() > kMostFields || characters > kMostCharacters)
    card.fail("a card of more than 8 lines is repeated");
}

}  // namespace

std::optional<double> nastran_number(std::string_view field) {
  std::string text;
  for (std::size_t i = 0; i < field.size(); ++i) {
    const char c = field[i];
    const bool is_letter = c == 'd' || c == 'D' || c == 'e' || c == 'E';
    const bool is_sign = (c == '+' || c == '-') && i > 0 && text.back() != 'e';
    if (is_sign) text += 'e';
    text += is_letter ? 'e' : c;
  }
  if (text.starts_with("+")) text.erase(0, 1);
  if (const std::size_t plus = text.find("e+"); plus != std::string::npos) text.erase(plus + 1, 1);
  return parse_number(text);
}

const std::string& NastranCard::field(std::size_t i) const {
  static const std::string kNone;
  return i < fields.size() ? fields[i] : kNone;
}

std::int64_t NastranCard::positive(std::size_t i, const char* what) const {
  const auto value = parse_integer(field(i));
  if (!value || *value <= 0)
    fail(std::string("expected ") + what + " (a positive whole number), found " + in_quotes(field(i)));
  return *value;
}

void NastranCards::visit(const std::function<void(const NastranCard&)>& visit) {
  visit_ = visit;
  read_file_of(name_, bytes_, 0);
  end_card();
}

void NastranCards::read_file_of(const std::string& file, std::string_view bytes, int depth) {
  files_.push_back(file);
  const std::string* name = &files_.back();
  TextScanner lines(file, bytes, TextScanner::Comments::none);
  while (const auto line = lines.line()) {
    const FilePlace place{name, lines.word_line()};
    auto input = included_in(*line);
    if (!input) {
      read_line(*line, place);
    } else {
      end_card();
      if (const char quote = input->empty() ? ' ' : input->front(); quote == '\'' || quote == '"') {
        input->erase(0, 1);
        while (input->find(quote) == std::string::npos) {  // a long path goes on in the next line
          const auto more = lines.line();
          if (!more || input->size() > kLongestPath)
            fail_at(place, "INCLUDE: expected a quote behind the name of the file");
          *input += trimmed(*more);
        }
        input->erase(input->find(quote));
      } else {
        *input = trimmed(input->substr(0, input->find('$')));
      }
      const IncludedFiles::File included = included_.read(place, *input, depth + 1);
      read_file_of(included.name, included.bytes, depth + 1);
    }
    if (is_over_) return;
  }
}

void NastranCards::read_line(std::string_view whole, const FilePlace& place) {
  const std::string line = without_tabs(whole.substr(0, whole.find('$')));
  if (trimmed(line).empty()) return;
  std::vector<std::string> fields = fields_of_card(line);
  std::string name = lower_case(fields[0]);
  if (name.ends_with('*')) name.pop_back();
  if (name.empty() || name[0] == '+' || name[0] == '*') {
    if (in_card_) continue_card(line, fields);
    return;
  }
  end_card();
  if (name == "enddata") {
    is_over_ = true;
    return;
  }
  fields[0] = name;
  card_ = {std::move(fields), place, {}};
  mark_ = mark_at(line, 72);
  in_card_ = true;
}

void NastranCards::continue_card(const std::string& line, const std::vector<std::string>& fields) {
  const std::string mark = mark_at(line, 0);
  if (card_.broken.empty() && !mark.empty() && !mark_.empty() && mark != mark_) card_.broken = mark;
  mark_ = mark_at(line, 72);
  card_.fields.insert(card_.fields.end(), fields.begin() + 1, fields.end());
}

void NastranCards::end_card() {
  if (!in_card_) return;
  in_card_ = false;
  const std::string& name = card_.name();
  if (name == "=") {
    repeat_with_changes();
  } else if (name[0] == '=') {
    const std::string count = name[1] == '(' && name.back() == ')' ? name.substr(2, name.size() - 3) : name.substr(1);
    const auto times = parse_integer(count);
    if (!times) card_.fail("expected '=' or '=(COUNT)' to repeat a card, found " + in_quotes(name));
    repeat(*times);
  } else {
    steps_.clear();
    visit_(card_);
    last_ = std::move(card_);
  }
}

/// Visits the card before, with fields that the new one changes: '=' keeps a field, '==' all from it on, and '*(x)'
/// adds x.
void NastranCards::repeat_with_changes() {
  if (last_.fields.empty()) card_.fail("'=' repeats a card, but there is none before it");
  require_short(last_);
  NastranCard next{{last_.name()}, card_.place, {}};
  steps_.assign(1, "");
  for (std::size_t i = 1; i < std::max(card_.fields.size(), last_.fields.size()); ++i) {
    if (card_.field(i) == "==") {
      for (; i < last_.fields.size(); ++i) next.fields.push_back(last_.fields[i]);
      break;
    }
    const auto step = step_of(card_.field(i));
    steps_.push_back(step.value_or(""));
    next.fields.push_back(step                    ? added(last_.field(i), *step)
                          : card_.field(i) == "=" ? last_.field(i)
                                                  : card_.field(i));
  }
  visit_(next);
  last_ = std::move(next);
}

void NastranCards::repeat(std::int64_t times) {
  constexpr std::int64_t kMostRepeatedCards = 1 << 20;  // a short line stands for many cards
  if (steps_.empty()) return;
  require_short(last_);
  if (times > kMostRepeatedCards - num_repeated_)
    card_.fail("more than " + std::to_string(kMostRepeatedCards) + " repeated cards");
  for (; times > 0; --times, ++num_repeated_) {
    last_.place = card_.place;
    for (std::size_t i = 1; i < steps_.size(); ++i)
      if (!steps_[i].empty()) last_.fields[i] = added(last_.fields[i], steps_[i]);
    visit_(last_);
  }
}

}  // namespace subvol::internal
