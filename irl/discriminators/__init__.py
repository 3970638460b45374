"""What tells the expert from the policy: losses, regularisers, methods."""
