// The parser's events with what they lack: the pointer and the line of each value.
//
// Internal to harness/config (see json_document.h).
#pragma once

#include <cstddef>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/json/json_document.h"

namespace loopbench::harness {

/// How far the parser has read.
struct Reading {
  std::size_t line = 1;
  std::size_t line_before = 1;  ///< without the last character: a number is read one too far
};

/// Gives the parser its characters and counts their lines.
class LineCounter {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  LineCounter(const char* at, Reading* reading) : at_(at), reading_(reading) {}
  reference operator*() const { return *at_; }
  LineCounter& operator++() {
    reading_->line_before = reading_->line;
    if (*at_ == '\n') ++reading_->line;
    ++at_;
    return *this;
  }
  LineCounter operator++(int) {
    LineCounter old = *this;
    ++*this;
    return old;
  }
  friend bool operator==(const LineCounter& a, const LineCounter& b) { return a.at_ == b.at_; }

 private:
  const char* at_;
  Reading* reading_;
};

/// Follows the parser through the document and knows the pointer and the line of each value.
class Walker : public nlohmann::json_sax<Json> {
 public:
  /// Walks through `text` to its end, or until a callback returns false.
  void Walk(std::string_view text) {
    const LineCounter begin(text.data(), &reading_), end(text.data() + text.size(), &reading_);
    Json::sax_parse(begin, end, this);
  }

  bool null() final { return Value(Json()); }
  bool boolean(bool value) final { return Value(Json(value)); }
  bool number_integer(number_integer_t value) final { return Value(Json(value)); }
  bool number_unsigned(number_unsigned_t value) final { return Value(Json(value)); }
  bool number_float(number_float_t value, const string_t& token) final {
    return CheckNumber(value, token) && Value(Json(value));
  }
  bool string(string_t& value) final { return Value(Json(std::move(value))); }
  bool binary(binary_t&) final { return true; }
  bool start_object(std::size_t) final { return Open(false); }
  bool start_array(std::size_t) final { return Open(true); }
  bool end_object() final { return Close(); }
  bool end_array() final { return Close(); }
  bool key(string_t& key) final {
    levels_.back().key = key;
    return Key(key);
  }

 protected:
  virtual bool Key(const std::string&) { return true; }
  virtual bool CheckNumber(double, const std::string&) { return true; }
  /// A value; containers come empty.
  virtual bool Put(Json value) = 0;
  /// The last container that was put and not finished is complete.
  virtual void Finish() {}

  /// Of the value or key that is being reported.
  std::string Pointer() const {
    std::string pointer;
    for (const Level& level : levels_) {
      pointer += "/" + (level.is_array ? std::to_string(level.index) : PointerToken(level.key));
    }
    return pointer;
  }
  std::size_t line() const { return reading_.line_before; }
  std::size_t depth() const { return levels_.size(); }
  const std::string& current_key() const { return levels_.back().key; }

 private:
  struct Level {
    bool is_array = false;
    std::size_t index = 0;
    std::string key;
  };

  bool Value(Json value) {
    const bool go_on = Put(std::move(value));
    if (!levels_.empty()) ++levels_.back().index;
    return go_on;
  }
  bool Open(bool is_array) {
    const bool go_on = Put(is_array ? Json::array() : Json::object());
    levels_.push_back({is_array, 0, {}});
    return go_on;
  }
  bool Close() {
    levels_.pop_back();
    if (!levels_.empty()) ++levels_.back().index;
    Finish();
    return true;
  }

  Reading reading_;
  std::vector<Level> levels_;
};

}  // namespace loopbench::harness
