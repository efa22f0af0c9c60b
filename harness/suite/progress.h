// A progress line with the time still to go, on standard error when that is a terminal.
#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace loopbench::harness {

/// Shows what is under way from the first moment on. Silent when standard error is no terminal.
class Progress {
 public:
  /// A piece of work: what people call it, and how long it will take about [s], NaN where nobody
  /// knows: then as long as the others.
  struct Piece {
    std::string label;
    double estimate_s;
  };

  /// `jobs` pieces are under way at once.
  Progress(std::string what, std::vector<Piece> pieces, int jobs);
  ~Progress();  ///< clears the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  static bool IsSeen();

  void Start(std::size_t piece);
  void Done(std::size_t piece);
  /// Draws the line anew if a second has passed.
  void Look();

 private:
  using Clock = std::chrono::steady_clock;
  struct Running {
    std::size_t piece;
    Clock::time_point begin;
  };

  /// Estimates are corrected by what the pieces that are done have taken. Negative: not known.
  double SecondsToGo() const;
  void Draw();

  std::string what_;
  std::vector<Piece> pieces_;
  int jobs_;
  bool is_seen_;
  std::size_t done_ = 0;
  double taken_s_ = 0.0, foreseen_s_ = 0.0;  ///< of the pieces that are done
  double waiting_s_ = 0.0;                   ///< foreseen for those that have not begun
  std::vector<Running> running_;
  Clock::time_point begin_, drawn_;
};

}  // namespace loopbench::harness
