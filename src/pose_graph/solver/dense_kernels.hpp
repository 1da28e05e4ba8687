// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Dense kernels of the sparse Cholesky factorisation. Plain doubles, column by column. The same
/// bits with every instruction set: products and sums are not fused and not reordered.
namespace gpureg::pose_graph {

/// Factorises the first `columns` columns of the symmetric size x size matrix (lower triangle,
/// leading dimension size): these columns become those of the Cholesky factor, the rest becomes the
/// Schur complement. Writes to the upper triangle too. Returns false where a pivot is not positive.
/// The bits do not depend on threads; small matrices use one.
bool partial_cholesky(double* matrix, int size, int columns, int threads);

}  // namespace gpureg::pose_graph
