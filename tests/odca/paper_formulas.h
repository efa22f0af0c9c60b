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

inline RealMatrix Inverse(const RealMatrix& A) {
  RealMatrix inverse(A.rows(), A.cols());
  for (int i = 0; i < A.cols(); ++i) {
    inverse.col(i) = testing::SolveFullPivot(A, RealVector::Unit(A.rows(), i), 0);
  }
  return inverse;
}

/// A body or an assembly by its two handles, (1-2), (5-6).
struct TwoHandles {
  RealMatrix z11, z12, z21, z22;  ///< zeta or Upsilon, d x d
  RealVector z13, z23;

  RealVector A1(const RealVector& F1, const RealVector& F2) const {
    return z11 * F1 + z12 * F2 + z13;
  }
  RealVector A2(const RealVector& F1, const RealVector& F2) const {
    return z21 * F1 + z22 * F2 + z23;
  }
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

  SeriesJoin(const TwoHandles& k, const TwoHandles& k1, const Cut& cut) {
    X = cut.D.transpose() * (k1.z11 + k.z22) * cut.D;  // (16)
    W = cut.D * Inverse(X) * cut.D.transpose();        // (20)
    Y = W * RealVector(k.z23 - k1.z13 + cut.Hdot_u);   // (21)
  }
};

/// The two-handle equations of the assembly.
inline TwoHandles Assemble(const TwoHandles& k, const TwoHandles& k1, const SeriesJoin& join) {
  return {.z11 = k.z11 - k.z12 * join.W * k.z21,     // (26)
          .z12 = k.z12 * join.W * k1.z12,            // (28)
          .z21 = k1.z21 * join.W * k.z21,            // (28), (23)
          .z22 = k1.z22 - k1.z21 * join.W * k1.z12,  // (27)
          .z13 = k.z13 - k.z12 * join.Y,             // (29)
          .z23 = k1.z23 + k1.z21 * join.Y};          // (30)
}

/// Measure numbers of the force on k1 at the joint.
inline RealVector MeasureNumbers(const TwoHandles& k, const TwoHandles& k1, const Cut& cut,
                                 const SeriesJoin& join, const RealVector& F_k,
                                 const RealVector& F_k1) {
  return Inverse(join.X) * cut.D.transpose() *
         RealVector(k.z21 * F_k - k1.z12 * F_k1 + k.z23 - k1.z13 + cut.Hdot_u);  // (17)
}

/// Returns the residual of (15) for these measure numbers.
inline RealVector Missing15(const TwoHandles& k, const TwoHandles& k1, const Cut& cut,
                            const RealVector& F_k, const RealVector& F_k1, const RealVector& f) {
  return cut.D.transpose() * (k1.z11 + k.z22) * cut.D * f -
         cut.D.transpose() *
             RealVector(k.z21 * F_k - k1.z12 * F_k1 + k.z23 - k1.z13 + cut.Hdot_u);  // (15)
}

/// A system between a base and a terminal joint to the inertial frame, (37-42).
struct GroundedLoop {
  RealMatrix chi;
  RealVector F_bb, F_tb;  ///< on the system
  RealVector missing37, missing38;

  GroundedLoop(const TwoHandles& sys, const Cut& bb, const Cut& tb) {
    const auto n = bb.D.cols(), m = tb.D.cols();
    // state-dependent accelerations are absorbed into the bias, as the text before (35) says
    const RealVector z13 = sys.z13 - bb.Hdot_u, z23 = sys.z23 - tb.Hdot_u;
    chi.resize(n + m, n + m);
    chi << bb.D.transpose() * sys.z11 * bb.D, bb.D.transpose() * sys.z12 * tb.D,  // (40)
        tb.D.transpose() * sys.z21 * bb.D, tb.D.transpose() * sys.z22 * tb.D;     // (41)
    RealVector chi_3(n + m);
    chi_3 << -bb.D.transpose() * z13, -tb.D.transpose() * z23;
    const RealVector f = testing::SolveFullPivot(chi, chi_3, 0);  // (42)
    F_bb = bb.D * f.head(n);                                      // (39)
    F_tb = tb.D * f.tail(m);
    missing37 = bb.D.transpose() * RealVector(sys.z11 * F_bb + sys.z12 * F_tb + z13);  // (37)
    missing38 = tb.D.transpose() * RealVector(sys.z21 * F_bb + sys.z22 * F_tb + z23);  // (38)
  }
};

/// Bodies 4, 5, 6, assembled as `sys`, hang from body 2 by the joints 4+ and 6-, (57-72).
struct CoupledLoop {
  RealMatrix X, Y, D;  ///< (66), an inverse; (67); (69)
  RealVector K;        ///< (68)
  RealMatrix zeta2;    ///< of body 2, 2d x 2d
  RealVector zeta2_3;

  CoupledLoop(const TwoHandles& body2, const TwoHandles& sys, const Cut& j4, const Cut& j6) {
    const auto d = j4.D.rows(), n = j4.D.cols(), m = j6.D.cols();
    RealMatrix matrix(n + m, n + m);
    matrix << j4.D.transpose() * (body2.z11 + sys.z11) * j4.D,
        j4.D.transpose() * (body2.z12 + sys.z12) * j6.D,
        j6.D.transpose() * (body2.z21 + sys.z21) * j4.D,
        j6.D.transpose() * (body2.z22 + sys.z22) * j6.D;
    X = Inverse(matrix);  // (66)
    Y.resize(n + m, 2 * d);
    Y << j4.D.transpose() * body2.z11, j4.D.transpose() * body2.z12, j6.D.transpose() * body2.z21,
        j6.D.transpose() * body2.z22;  // (67)
    K.resize(n + m);
    K << j4.D.transpose() * RealVector(body2.z13 - sys.z13 + j4.Hdot_u),
        j6.D.transpose() * RealVector(body2.z23 - sys.z23 + j6.Hdot_u);  // (68)
    D.setZero(2 * d, n + m);
    D.topLeftCorner(d, n) = j4.D;  // (69)
    D.bottomRightCorner(d, m) = j6.D;
    zeta2.resize(2 * d, 2 * d);
    zeta2 << body2.z11, body2.z12, body2.z21, body2.z22;
    zeta2_3.resize(2 * d);
    zeta2_3 << body2.z13, body2.z23;
  }

  /// [F4+; F6-] for the outer forces [F2+; F2-] on body 2. The inner forces on body 2 are opposite.
  RealVector Force(const RealVector& F_ext) const {
    return D * (X * (Y * F_ext) + X * K);  // (65)
  }
  RealMatrix ZetaAsm() const {
    return zeta2 * (RealMatrix::Identity(D.rows(), D.rows()) - D * X * Y);  // (71)
  }
  RealVector ZetaAsm3AsPrinted() const { return zeta2_3 - D * X * K; }  // (72)
  /// With the factor that the printed formula lacks.
  RealVector ZetaAsm3() const { return zeta2_3 - zeta2 * (D * X * K); }

  TwoHandles Asm() const {
    const auto d = D.rows() / 2;
    const RealMatrix z = ZetaAsm();
    const RealVector z3 = ZetaAsm3();
    return {z.topLeftCorner(d, d),
            z.topRightCorner(d, d),
            z.bottomLeftCorner(d, d),
            z.bottomRightCorner(d, d),
            z3.head(d),
            z3.tail(d)};
  }
};

/// Returns the residuals of (57) and (58); (60) and (62) are the same, sorted.
inline RealVector Missing57And58(const TwoHandles& body2, const TwoHandles& sys, const Cut& j4,
                                 const Cut& j6, const RealVector& F_ext, const RealVector& F) {
  const auto d = j4.D.rows();
  const RealVector ext1 = F_ext.head(d), ext2 = F_ext.tail(d), F4 = F.head(d), F6 = F.tail(d);
  RealVector missing(j4.D.cols() + j6.D.cols());
  missing << j4.D.transpose() *
                 RealVector(body2.z11 * ext1 + body2.z12 * ext2 - (body2.z11 + sys.z11) * F4 -
                            (body2.z12 + sys.z12) * F6 + body2.z13 - sys.z13 + j4.Hdot_u),  // (57)
      j6.D.transpose() *
          RealVector(body2.z21 * ext1 + body2.z22 * ext2 - (body2.z21 + sys.z21) * F4 -
                     (body2.z22 + sys.z22) * F6 + body2.z23 - sys.z23 + j6.Hdot_u);  // (58)
  return missing;
}

}  // namespace loopbench::odca::paper
