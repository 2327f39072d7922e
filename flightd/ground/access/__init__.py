"""Who may do what at the ground station: people and programs, their roles, sign-in, sessions, the audit."""
