#pragma once

#include "feeler/cli/common/session.h"
