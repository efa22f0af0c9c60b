// The paper's formulas as they are printed: dense long double, accelerations and forces at handles,
// nothing projected or shifted beforehand. Nothing here knows the code under test.
//
// Vectors have d components, [angular; linear] or [moment; force]; the paper has d = 6, and the
// same formulas hold with d = 3 in the plane. Minus signs cannot be read in the text at hand; they
// are those that follow from (1-7) and Newton's third law.
#pragma once

#include "tests/contract/dense.h"

namespace loopbench::odca::paper {

using testing::RealMatrix;
using testing::RealVector;

RealMatrix Inverse(const RealMatrix& A);

/// A body or an assembly by its two handles, (1-2), (5-6).
struct TwoHandles {
  RealMatrix z11, z12, z21, z22;  ///< zeta or Upsilon, d x d
  RealVector z13, z23;

  RealVector A1(const RealVector& F1, const RealVector& F2) const;
  RealVector A2(const RealVector& F1, const RealVector& F2) const;
};

/// A joint: D, and what its relative acceleration is beside H udot (7).
struct Cut {
  RealMatrix D;
  RealVector Hdot_u;
};

/// A series join of k and k1, (15-21).
struct SeriesJoin {
  RealMatrix X, W;  ///< X (16), W-hat (20)
  RealVector Y;     ///< Y-hat (21)

  SeriesJoin(const TwoHandles& k, const TwoHandles& k1, const Cut& cut);
};

/// The two-handle equations of the assembly.
TwoHandles Assemble(const TwoHandles& k, const TwoHandles& k1, const SeriesJoin& join);

/// Measure numbers of the force on k1 at the joint.
RealVector MeasureNumbers(const TwoHandles& k, const TwoHandles& k1, const Cut& cut,
                          const SeriesJoin& join, const RealVector& F_k, const RealVector& F_k1);

/// What (15) misses for these measure numbers.
RealVector Missing15(const TwoHandles& k, const TwoHandles& k1, const Cut& cut,
                     const RealVector& F_k, const RealVector& F_k1, const RealVector& f);

/// A system between a base and a terminal joint to the inertial frame, (37-42).
struct GroundedLoop {
  RealMatrix chi;
  RealVector F_bb, F_tb;  ///< on the system
  RealVector missing37, missing38;

  GroundedLoop(const TwoHandles& sys, const Cut& bb, const Cut& tb);
};

/// Bodies 4, 5, 6, assembled as `sys`, hang from body 2 by the joints 4+ and 6-, (57-72).
struct CoupledLoop {
  RealMatrix X, Y, D;  ///< (66), an inverse; (67); (69)
  RealVector K;        ///< (68)
  RealMatrix zeta2;    ///< of body 2, 2d x 2d
  RealVector zeta2_3;

  CoupledLoop(const TwoHandles& body2, const TwoHandles& sys, const Cut& j4, const Cut& j6);

  /// [F4+; F6-] for the outer forces [F2+; F2-] on body 2. The inner forces on body 2 are opposite.
  RealVector Force(const RealVector& F_ext) const;  // (65)

  RealMatrix ZetaAsm() const;            // (71)
  RealVector ZetaAsm3AsPrinted() const;  // (72)
  /// With the factor that the printed formula lacks.
  RealVector ZetaAsm3() const;

  TwoHandles Asm() const;
};

/// What (57) and (58) miss, one after the other; (60) and (62) are the same, sorted.
RealVector Missing57And58(const TwoHandles& body2, const TwoHandles& sys, const Cut& j4,
                          const Cut& j6, const RealVector& F_ext, const RealVector& F);

}  // namespace loopbench::odca::paper
