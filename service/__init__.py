"""The HTTP service: it validates, queues, caches and answers, and renders nothing itself."""
