"""The reference of each phase, when a phase is over, relocation and touch-down."""
