// exp, log and pow for what runs inside a step: the set that plugins use too.
#pragma once
#include "deform/elementary.h"
