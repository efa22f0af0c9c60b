#include "harness/suite/progress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "harness/text/cells.h"
#include "harness/text/escape.h"
#include "harness/text/screen.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {

namespace {

constexpr const char* kClear = "\r\033[K";  // the line that is there

double SecondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

Progress::Progress(std::string what, std::vector<Piece> pieces, int jobs)
    : what_(std::move(what)),
      pieces_(std::move(pieces)),
      jobs_(jobs),
      is_seen_(IsSeen()),
      begin_(Clock::now()) {
  double known = 0.0;
  std::size_t count = 0;
  for (const Piece& piece : pieces_) {
    if (std::isnan(piece.estimate_s)) continue;
    known += piece.estimate_s;
    ++count;
  }
  for (Piece& piece : pieces_) {
    if (!std::isnan(piece.estimate_s)) continue;
    piece.estimate_s = count > 0 ? known / static_cast<double>(count) : 0.0;
  }
  waiting_s_ =
      std::accumulate(pieces_.begin(), pieces_.end(), 0.0,
                      [](double sum, const Piece& piece) { return sum + piece.estimate_s; });
  Draw();
}

Progress::~Progress() {
  if (is_seen_) PrintErrorText(kClear);
}

bool Progress::IsSeen() { return ErrorScreen().width > 0; }

void Progress::Start(std::size_t piece) {
  running_.push_back({piece, Clock::now()});
  waiting_s_ -= pieces_[piece].estimate_s;
  Draw();
}

void Progress::Done(std::size_t piece) {
  const auto at = std::ranges::find(running_, piece, &Running::piece);
  ++done_;
  taken_s_ += SecondsSince(at->begin);
  foreseen_s_ += pieces_[piece].estimate_s;
  running_.erase(at);
  Draw();
}

void Progress::Look() {
  if (is_seen_ && SecondsSince(drawn_) >= 1.0) Draw();
}

double Progress::SecondsToGo() const {
  if (foreseen_s_ + waiting_s_ + (running_.empty() ? 0.0 : pieces_[running_[0].piece].estimate_s) <=
      0.0) {
    // nothing was foreseen: all pieces are taken to be alike
    if (done_ == 0) return -1.0;
    return SecondsSince(begin_) * static_cast<double>(pieces_.size() - done_) /
           static_cast<double>(done_);
  }
  const double factor = foreseen_s_ > 0.0 ? taken_s_ / foreseen_s_ : 1.0;
  double left = factor * waiting_s_;
  for (const Running& one : running_) {
    left += std::max(0.0, factor * pieces_[one.piece].estimate_s - SecondsSince(one.begin));
  }
  return left / std::min<double>(jobs_, static_cast<double>(pieces_.size() - done_));
}

void Progress::Draw() {
  if (!is_seen_ || done_ == pieces_.size()) return;
  drawn_ = Clock::now();
  const double left = SecondsToGo();
  std::string line =
      fmt::format("{} {}/{}  {:.0f} s gone", what_, done_, pieces_.size(), SecondsSince(begin_));
  if (left >= 0.0) line += fmt::format(", about {:.0f} s to go", std::ceil(left));
  if (!running_.empty()) {
    const Running& oldest = running_.front();
    line +=
        fmt::format("  now {} ({:.0f} s)", pieces_[oldest.piece].label, SecondsSince(oldest.begin));
    if (running_.size() > 1) line += fmt::format(" and {} more", running_.size() - 1);
  }
  // in one line, whose last cell some terminals do not write without beginning the next
  const std::size_t room = std::max<std::size_t>(ErrorScreen().width, 3) - 1;
  PrintErrorText(kClear + std::string(Beginning(EscapeTerminal(line), room)));
}

}  // namespace loopbench::harness
