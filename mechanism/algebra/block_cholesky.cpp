#include "mechanism/algebra/block_cholesky.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>

#include "mechanism/algebra/known_size.h"

namespace loopbench {

namespace {

/// Rows that a joint can have.
constexpr int kMaxRows = 6;

/// Blocks in the order of their elimination.
std::vector<int> MinimumDegree(int blocks, std::span<const std::pair<int, int>> pairs) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < blocks; ++i) entries.emplace_back(i, i, 1.0);
  for (const auto& [i, j] : pairs) {
    entries.emplace_back(i, j, 1.0);
    entries.emplace_back(j, i, 1.0);
  }
  Eigen::SparseMatrix<double> pattern(blocks, blocks);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(pattern, order);
  return {order.indices().data(), order.indices().data() + blocks};
}

/// Fill of an elimination order: for each column, the columns below whose rows fill.
struct Elimination {
  std::vector<int> sequence, order;  ///< blocks by column, columns by block
  std::vector<std::vector<int>> below;
  double numbers = 0.0;  ///< in L, or more than `most` if stopped
};

Elimination Eliminate(std::vector<int> sequence, const std::vector<int>& rows,
                      std::span<const std::pair<int, int>> pairs, double most) {
  Elimination all{std::move(sequence), std::vector<int>(rows.size()), {}, 0.0};
  all.below.resize(rows.size());
  for (std::size_t j = 0; j < rows.size(); ++j) all.order[all.sequence[j]] = static_cast<int>(j);
  for (const auto& [i, j] : pairs) {
    const auto [first, last] = std::minmax(all.order[i], all.order[j]);
    all.below[first].push_back(last);
  }
  for (std::size_t j = 0; j < rows.size() && all.numbers <= most; ++j) {
    std::vector<int>& below = all.below[j];
    std::ranges::sort(below);
    below.erase(std::unique(below.begin(), below.end()), below.end());
    const double own = rows[all.sequence[j]];
    all.numbers += own * own;
    for (int i : below) all.numbers += own * rows[all.sequence[i]];
    if (below.empty()) continue;
    std::vector<int>& parent = all.below[below.front()];
    parent.insert(parent.end(), below.begin() + 1, below.end());
  }
  return all;
}

/// Returns approximate minimum degree or the order from the last block to the first, whichever
/// fills less. The latter fills nothing for the joints of a tree, the former a quarter more.
Elimination BestElimination(const std::vector<int>& rows,
                            std::span<const std::pair<int, int>> pairs, double most) {
  const int blocks = static_cast<int>(rows.size());
  Elimination by_degree = Eliminate(MinimumDegree(blocks, pairs), rows, pairs, most);
  std::vector<int> backwards(rows.size());
  for (int j = 0; j < blocks; ++j) backwards[j] = blocks - 1 - j;
  Elimination from_last =
      Eliminate(std::move(backwards), rows, pairs, std::min(most, by_degree.numbers));
  return from_last.numbers < by_degree.numbers ? from_last : by_degree;
}

}  // namespace

BlockCholesky::BlockCholesky(const std::vector<int>& rows,
                             std::span<const std::pair<int, int>> pairs, double most)
    : columns_(rows.size()), number_of_(rows.size()) {
  const int blocks = static_cast<int>(rows.size());
  Elimination elimination = BestElimination(rows, pairs, most);
  numbers_ = elimination.numbers;
  order_ = std::move(elimination.order);
  const std::vector<int>& sequence = elimination.sequence;
  const std::vector<std::vector<int>>& below = elimination.below;
  if (numbers_ > most) return;
  std::vector<int> lefts(rows.size(), 0);
  for (int j = 0; j < blocks; ++j) {
    for (int i : below[j]) ++lefts[i];
    if (!below[j].empty()) columns_[below[j].front()].eliminated += columns_[j].eliminated;
  }
  int number = 0, first_left = 0;
  for (int j = 0; j < blocks; ++j) {
    Column& column = columns_[j];
    column.block = sequence[j];
    column.rows = rows[column.block];
    column.first_number = number;
    column.first_row = static_cast<int>(below_.size());
    column.num_rows = static_cast<int>(below[j].size());
    column.first_left = first_left;
    first_left += lefts[j];
    number += column.rows * column.rows;
    for (int i : below[j]) {
      below_.push_back({i, number});
      number += rows[sequence[i]] * column.rows;
    }
  }
  left_.resize(below_.size());
  for (int k = 0; k < blocks; ++k) {
    int left_over = 0;
    for (int s = columns_[k].first_row + columns_[k].num_rows - 1; s >= columns_[k].first_row;
         --s) {
      Column& row = columns_[below_[s].column];
      left_[row.first_left + row.num_left++] = {k, s};
      left_over += row.rows;
      operations_ += static_cast<double>(row.rows * columns_[k].rows * (left_over + 2));
    }
    operations_ += std::pow(columns_[k].rows, 3) / 6.0 + std::pow(columns_[k].rows, 2);
  }
  for (std::size_t block = 0; block < rows.size(); ++block) {
    columns_[order_[block]].first = size_;
    size_ += rows[block];
  }
  const bool is_uniform = std::ranges::all_of(rows, [&](int r) { return r == rows.front(); });
  uniform_ = !rows.empty() && is_uniform ? rows.front() : 0;
  L_.assign(static_cast<std::size_t>(number), 0.0);
  ratios_.assign(rows.size(), 1.0);
}

void BlockCholesky::SetZero() { std::ranges::fill(L_, 0.0); }

double* BlockCholesky::OffDiagonal(int i, int j) {
  const Column& column = columns_[std::min(order_[i], order_[j])];
  const auto first = below_.begin() + column.first_row, last = first + column.num_rows;
  const auto row =
      std::ranges::lower_bound(first, last, std::max(order_[i], order_[j]), {}, &Below::column);
  return row != last && row->column == std::max(order_[i], order_[j]) ? &L_[row->number] : nullptr;
}

// kRows below: rows of every block, 0 where they differ. Diagonals of L hold their reciprocals.

namespace {

template <int kRows, class Call>
[[gnu::always_inline]] inline auto WithRows(int rows, const Call& call) {
  if constexpr (kRows > 0) {
    return call(std::integral_constant<int, kRows>());
  } else {
    return WithSize<double, 2, 3, 5>(rows, call);
  }
}

}  // namespace

/// A_ij -= L_ik L_jk^T for all columns k to the left that have a row in j.
template <int kRows, class Size>
void BlockCholesky::Eliminate(int j, Size n) {
  const Column& column = columns_[j];
  const Below *first = below_.data() + column.first_row, *end = first + column.num_rows;
  number_of_[j] = column.first_number;
  for (const Below* row = first; row != end; ++row) number_of_[row->column] = row->number;
  for (int l = column.first_left; l < column.first_left + column.num_left; ++l) {
    const Column& left = columns_[left_[l].column];
    const Below *row = &below_[left_[l].place],
                *last = below_.data() + left.first_row + left.num_rows;
    const double* L_jk = &L_[row->number];
    WithRows<kRows>(left.rows, [&](auto m) {
      for (; row != last; ++row) {
        const int h = kRows > 0 ? kRows : columns_[row->column].rows;
        const double* L_ik = &L_[row->number];
        double* A_ij = &L_[number_of_[row->column]];
        for (int a = 0; a < h; ++a) {
          for (int b = 0; b < n; ++b) {
            double sum = A_ij[a * n + b];
            Repeat(m, [&](int c) { sum -= L_ik[a * m + c] * L_jk[b * m + c]; });
            A_ij[a * n + b] = sum;
          }
        }
      }
    });
  }
}

namespace {

/// The pivots of a diagonal block alone: of its factors L D L^T.
template <class Size>
void PivotsOf(const double* block, Size n, std::array<double, kMaxRows>& pivots) {
  std::array<double, kMaxRows * kMaxRows> L;
  for (int c = 0; c < n; ++c) {
    for (int a = c; a < n; ++a) {
      double sum = block[a * n + c];
      for (int d = 0; d < c; ++d) sum -= L[a * n + d] * L[c * n + d] * pivots[d];
      if (a == c) pivots[c] = sum;
      L[a * n + c] = a == c ? 1.0 : sum / pivots[c];
    }
  }
}

}  // namespace

template <int kRows, class Size>
bool BlockCholesky::FactorColumn(int j, Size n) {
  const Column& column = columns_[j];
  double* diagonal = &L_[column.first_number];
  std::array<double, kMaxRows> before;
  PivotsOf(diagonal, n, before);
  Eliminate<kRows>(j, n);
  double least = 1.0;
  for (int c = 0; c < n; ++c) {
    for (int a = c; a < n; ++a) {
      double sum = diagonal[a * n + c];
      for (int d = 0; d < c; ++d) sum -= diagonal[a * n + d] * diagonal[c * n + d];
      if (a > c) {
        diagonal[a * n + c] = sum * diagonal[c * n + c];
        continue;
      }
      if (!(sum > 0.0)) {
        ratios_[j] = 0.0;
        return false;
      }
      least = std::min(least, sum / before[c]);
      diagonal[c * n + c] = 1.0 / std::sqrt(sum);
    }
  }
  ratios_[j] = least;
  const Below* row = below_.data() + column.first_row;
  for (const Below* end = row + column.num_rows; row != end; ++row) {
    const int h = kRows > 0 ? kRows : columns_[row->column].rows;
    double* block = &L_[row->number];
    for (int a = 0; a < h; ++a) {
      for (int c = 0; c < n; ++c) {
        double sum = block[a * n + c];
        for (int d = 0; d < c; ++d) sum -= block[a * n + d] * diagonal[c * n + d];
        block[a * n + c] = sum * diagonal[c * n + c];
      }
    }
  }
  return true;
}

bool BlockCholesky::Factor() {
  return WithSize<double, 2, 3, 5>(uniform_, [&](auto rows) {
    constexpr int kRows = kKnownSize<decltype(rows)>;
    for (int j = 0; j < static_cast<int>(columns_.size()); ++j) {
      if (WithRows<kRows>(columns_[j].rows, [&](auto n) { return FactorColumn<kRows>(j, n); })) {
        continue;
      }
      std::fill(ratios_.begin() + j + 1, ratios_.end(), 1.0);
      return false;
    }
    return true;
  });
}

/// L y = x down the columns, L^T x = y back.
template <int kRows>
void BlockCholesky::SolveColumns(double* all) const {
  for (const Column& column : columns_) {
    WithRows<kRows>(column.rows, [&](auto n) {
      const double* diagonal = &L_[column.first_number];
      double* x = &all[column.first];
      for (int a = 0; a < n; ++a) {
        double sum = x[a];
        for (int b = 0; b < a; ++b) sum -= diagonal[a * n + b] * x[b];
        x[a] = sum * diagonal[a * n + a];
      }
      const Below* row = below_.data() + column.first_row;
      for (const Below* end = row + column.num_rows; row != end; ++row) {
        const int h = kRows > 0 ? kRows : columns_[row->column].rows;
        const double* block = &L_[row->number];
        double* y = &all[columns_[row->column].first];
        for (int a = 0; a < h; ++a) {
          double sum = y[a];
          Repeat(n, [&](int b) { sum -= block[a * n + b] * x[b]; });
          y[a] = sum;
        }
      }
    });
  }
  for (auto column = columns_.rbegin(); column != columns_.rend(); ++column) {
    WithRows<kRows>(column->rows, [&](auto n) {
      const double* diagonal = &L_[column->first_number];
      double* x = &all[column->first];
      const Below* row = below_.data() + column->first_row;
      for (const Below* end = row + column->num_rows; row != end; ++row) {
        const int h = kRows > 0 ? kRows : columns_[row->column].rows;
        const double* block = &L_[row->number];
        const double* y = &all[columns_[row->column].first];
        for (int b = 0; b < n; ++b) {
          double sum = x[b];
          for (int a = 0; a < h; ++a) sum -= block[a * n + b] * y[a];
          x[b] = sum;
        }
      }
      for (int a = n - 1; a >= 0; --a) {
        double sum = x[a];
        for (int b = a + 1; b < n; ++b) sum -= diagonal[b * n + a] * x[b];
        x[a] = sum * diagonal[a * n + a];
      }
    });
  }
}

void BlockCholesky::Solve(double* x) const {
  WithSize<double, 2, 3, 5>(uniform_,
                            [&](auto rows) { SolveColumns<kKnownSize<decltype(rows)>>(x); });
}

}  // namespace loopbench
