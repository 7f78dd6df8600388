#include "parallel/gather_rows.h"

#include <utility>
#include <vector>

namespace freevoxel {

Image gatherRows(const Ranks& ranks, Image band) {
  if (ranks.rankCount() == 1) return band;
  ranks.agree();
  const Ranks::Exchange exchange(ranks);
  const MPI_Comm communicator = ranks.communicator();
  const int rows = band.size.y;
  std::vector<int> rowsOf(size_t(ranks.rankCount())), firstOf(rowsOf.size());
  MPI_Allgather(&rows, 1, MPI_INT, rowsOf.data(), 1, MPI_INT, communicator);
  int all = 0;
  for (size_t rank = 0; rank < rowsOf.size(); ++rank) {
    firstOf[rank] = all;
    all += rowsOf[rank];
  }
  Image whole;
  if (ranks.isRoot()) whole = Image(glm::ivec2(band.size.x, all), band.channels);
  // Rows are counted, so that no count overflows.
  MPI_Datatype row = MPI_DATATYPE_NULL;
  MPI_Type_contiguous(band.size.x * band.channels, MPI_FLOAT, &row);
  MPI_Type_commit(&row);
  MPI_Gatherv(band.pixels.data(), rows, row, whole.pixels.data(), rowsOf.data(), firstOf.data(), row, 0, communicator);
  MPI_Type_free(&row);
  return whole;
}

}  // namespace freevoxel
