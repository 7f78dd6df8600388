// The processes of one run, and how they agree that one of them has failed (DESIGN section 9).
//
// Errors are exceptions, thrown on one rank while the others go on. So every rank comes to agree() between its stages,
// and whoever has failed goes there at once, whatever stage it was in: the lowest rank that failed tells all others
// why. What lies between two agreements may therefore throw on one rank alone as long as it waits for nobody; what
// waits for others (collective operations) stands inside a Ranks::Exchange, and an exception in there can only end the
// whole job.
#pragma once

#include <mpi.h>

#include <optional>
#include <string>
#include <vector>

namespace freevoxel {

/// Why a rank cannot go on. `status` is the exit status that the program would end with.
struct Failure {
  int rank = 0;
  int status = 1;
  std::string text;  ///< one line
};

/// The processes that mpirun, srun or another launcher started together: MPI is initialised if one did, and only then.
/// Without a launcher there is one rank, and nothing here costs anything. One object per process, made before threads
/// start; it finalises MPI when it goes. Not movable.
class Ranks {
 public:
  Ranks(int& argc, char**& argv);
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  int rank() const { return rank_; }
  int rankCount() const { return rankCount_; }
  /// The one that speaks and writes.
  bool isRoot() const { return rank_ == 0; }
  bool launched() const { return launched_; }
  /// Of all ranks. Only if launched().
  MPI_Comm communicator() const { return communicator_; }

  /// Threads that leave every rank of this machine its share of the cores it may use, at least 1. Collective.
  int fairThreadCount() const;

  /// Collective: returns the failure of the lowest rank that came with one, the same on all ranks; nothing if all is
  /// well.
  std::optional<Failure> agree(const std::optional<Failure>& mine) const;
  /// The same for a rank that is well: throws RankFailed if another one is not. Does nothing for one rank.
  void agree() const;

  /// Collective: everybody's text, by rank.
  std::vector<std::string> gatherEverywhere(const std::string& mine) const;

  /// While it lives the rank waits for others, or they for it.
  class Exchange {
   public:
    explicit Exchange(const Ranks& ranks);
    ~Exchange();
    Exchange(const Exchange&) = delete;
    Exchange& operator=(const Exchange&) = delete;

   private:
    const Ranks& ranks_;
    int exceptionsBefore_;
  };
  /// Whether an exception ended an Exchange: others wait for this rank in vain, and only MPI_Abort is left.
  bool outOfStep() const { return outOfStep_; }

 private:
  bool launched_ = false;
  int rank_ = 0, rankCount_ = 1;
  MPI_Comm communicator_ = MPI_COMM_NULL;
  mutable bool outOfStep_ = false;
};

/// What agree() throws on the ranks that have not failed themselves.
struct RankFailed {
  Failure failure;
};

/// Of the machine this process runs on; empty if it has no name.
std::string hostName();

/// Whether the environment is that of a process started by a launcher of MPI programs.
bool startedByLauncher();

}  // namespace freevoxel
