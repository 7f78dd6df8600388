#include "parallel/distributed_precompute.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace freevoxel {

namespace {

/// Bytes of one message: MPI counts in int.
constexpr size_t kLargestMessage = size_t(1) << 28;

class RankTeam final : public SlabTeam {
 public:
  explicit RankTeam(const Ranks& ranks) : ranks_(ranks) {}

  int rank() const override { return ranks_.rank(); }
  int rankCount() const override { return ranks_.rankCount(); }
  void agree() override { ranks_.agree(); }
  std::vector<std::string> gatherEverywhere(const std::string& mine) override { return ranks_.gatherEverywhere(mine); }

  void send(int toRank, std::span<const std::byte> bytes) override {
    const Ranks::Exchange exchange(ranks_);
    for (; !bytes.empty(); bytes = bytes.subspan(std::min(bytes.size(), kLargestMessage)))
      MPI_Send(bytes.data(), int(std::min(bytes.size(), kLargestMessage)), MPI_BYTE, toRank, 0, ranks_.communicator());
  }
  void receive(int fromRank, std::span<std::byte> bytes) override {
    const Ranks::Exchange exchange(ranks_);
    for (; !bytes.empty(); bytes = bytes.subspan(std::min(bytes.size(), kLargestMessage)))
      MPI_Recv(bytes.data(), int(std::min(bytes.size(), kLargestMessage)), MPI_BYTE, fromRank, 0, ranks_.communicator(),
               MPI_STATUS_IGNORE);
  }

 private:
  const Ranks& ranks_;
};

}  // namespace

PrecomputeResult precompute(VolumeSource& source, const TransferFunction& transfer, const std::string& path,
                            const PrecomputeOptions& options, const Ranks& ranks, Progress& progress) {
  RankTeam team(ranks);
  return precompute(source, transfer, path, options, team, progress);
}

}  // namespace freevoxel
