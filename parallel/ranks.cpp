#include "parallel/ranks.h"

#include <omp.h>
#include <sched.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>
#include <cstring>
#include <exception>
#include <numeric>
#include <vector>

namespace freevoxel {

std::string hostName() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  return name.data();
}

bool startedByLauncher() {
  // Open MPI's mpirun; PMI of MPICH, Intel MPI and Slurm; PMIx of Slurm and others.
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMI_RANK", "PMIX_RANK"}) {
    if (getenv(name) != nullptr) return true;
  }
  return false;
}

Ranks::Ranks(int& argc, char**& argv) : launched_(startedByLauncher()) {
  if (!launched_) return;
  int provided = 0;
  MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &provided);
  MPI_Comm_dup(MPI_COMM_WORLD, &communicator_);
  MPI_Comm_rank(communicator_, &rank_);
  MPI_Comm_size(communicator_, &rankCount_);
}

Ranks::~Ranks() {
  if (!launched_) return;
  MPI_Comm_free(&communicator_);
  MPI_Finalize();
}

int Ranks::fairThreadCount() const {
  const int cores = omp_get_num_procs();  // that this rank is bound to
  if (!launched_) return cores;
  cpu_set_t mine;
  CPU_ZERO(&mine);
  if (sched_getaffinity(0, sizeof mine, &mine) != 0) return 1;
  const Exchange exchange(*this);
  MPI_Comm machine = MPI_COMM_NULL;
  MPI_Comm_split_type(communicator_, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL, &machine);
  int neighbours = 1;
  MPI_Comm_size(machine, &neighbours);
  std::vector<cpu_set_t> sets(static_cast<size_t>(neighbours));
  MPI_Allgather(&mine, sizeof mine, MPI_BYTE, sets.data(), sizeof mine, MPI_BYTE, machine);
  MPI_Comm_free(&machine);
  const auto sharing =
      std::count_if(sets.begin(), sets.end(), [&](const cpu_set_t& set) { return CPU_EQUAL(&set, &mine) != 0; });
  return std::max(1, cores / int(sharing));
}

std::optional<Failure> Ranks::agree(const std::optional<Failure>& mine) const {
  if (!launched_) return mine;
  int failed = mine ? rank_ : INT_MAX;
  MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MIN, communicator_);
  if (failed == INT_MAX) return std::nullopt;
  struct {
    int status;
    char text[2044];
  } message{};
  if (mine && failed == rank_) {
    message.status = mine->status;
    std::strncpy(message.text, mine->text.c_str(), sizeof message.text - 1);
  }
  MPI_Bcast(&message, sizeof message, MPI_BYTE, failed, communicator_);
  return Failure{failed, message.status, message.text};
}

void Ranks::agree() const {
  if (rankCount_ == 1) return;
  if (const std::optional<Failure> failure = agree(std::nullopt)) throw RankFailed{*failure};
}

std::vector<std::string> Ranks::gatherEverywhere(const std::string& mine) const {
  if (!launched_) return {mine};
  const Exchange exchange(*this);
  std::vector<int> lengths(static_cast<size_t>(rankCount_)), starts(lengths.size());
  const int length = int(mine.size());
  MPI_Allgather(&length, 1, MPI_INT, lengths.data(), 1, MPI_INT, communicator_);
  std::exclusive_scan(lengths.begin(), lengths.end(), starts.begin(), 0);
  std::string joined(size_t(starts.back()) + size_t(lengths.back()), '\0');
  MPI_Allgatherv(mine.data(), length, MPI_CHAR, joined.data(), lengths.data(), starts.data(), MPI_CHAR, communicator_);
  std::vector<std::string> all;
  for (size_t rank = 0; rank < lengths.size(); ++rank)
    all.push_back(joined.substr(size_t(starts[rank]), size_t(lengths[rank])));
  return all;
}

Ranks::Exchange::Exchange(const Ranks& ranks) : ranks_(ranks), exceptionsBefore_(std::uncaught_exceptions()) {}

Ranks::Exchange::~Exchange() {
  if (ranks_.rankCount_ > 1 && std::uncaught_exceptions() > exceptionsBefore_) ranks_.outOfStep_ = true;
}

}  // namespace freevoxel
