#pragma once

namespace feeler {

/// CPU seconds that the calling thread has used.
double ThreadCpuSeconds();
/// CPU seconds that all threads of the process have used, ended ones included.
double ProcessCpuSeconds();

}  // namespace feeler
